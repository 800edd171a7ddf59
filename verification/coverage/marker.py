"""The mark that a verification puts beside itself, and a test as `pytest.mark.covers`: what of the seeds it covers."""


def covers(
    items: str, *implemented: str, figures: tuple[str, ...] = (), differs: str = "", impossible: str = ""
) -> None:
    """Do nothing: `verification/coverage` reads the call from the source.

    Args:
        items: document and items as its list here (`joshi.csv`, ...) has them: "Joshi Table 4.3; Fig. 4.1".
        implemented: files of formation_gnc that hold what flies, as "control/lqr.py".
        figures: names of rows of the tables *figure, printed, ours* of the verification pages.
        differs: in what ours differs from the document, or what of it is not there to compare with.
        impossible: why it cannot be reproduced.
    """
