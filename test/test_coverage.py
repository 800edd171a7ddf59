"""The page of what is covered of the five documents, and the marks that it is made from."""

import pytest

from verification import coverage
from verification.coverage import Mark, Row

ROWS = {"a": Row("1 m", "1 m", True), "b": Row("", "1 m", True), "c": Row("1 m", "9 m", False)}


def mark(items: tuple[str, ...], *implemented: str, verified: str = "[seeds](seeds.md)", **more: object) -> Mark:
    return Mark("place", verified, "Joshi", items, implemented, **more)  # type: ignore[arg-type]


def test_page_is_what_marks_and_pages_say() -> None:
    written = (coverage.PAGES / "coverage.md").read_text(encoding="utf-8")
    assert written == coverage.page(), "stale: python -m verification coverage"


def test_marks_name_tests_items_files_and_figures_that_exist() -> None:
    assert coverage.check(coverage.marks(), coverage.figures()) == []


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (mark(("Table 99",), figures=("a",)), "no item 'Table 99'"),
        (mark(("Table 4.3",), "control/none.py", figures=("a",)), "no file formation_gnc/control/none.py"),
        (mark(("Table 4.3",), figures=("a", "z")), "no page has a figure 'z'"),
        (mark(("Table 4.3",), figures=("a", "c")), "outside its tolerance"),
        (mark(("Table 4.3",)), "without a figure"),
        (mark(("Table 4.3",), figures=("b",)), "without a figure"),
        (mark(("Table 4.3",), verified="`test_it`"), "without a figure"),
    ],
)
def test_a_mark_that_claims_what_is_not_there_is_named(wrong: Mark, words: str) -> None:
    (line,) = coverage.check([wrong], ROWS)
    assert words in line


def test_equations_need_a_test_and_differences_their_words() -> None:
    fine = [
        mark(("(3.16)",), verified="`test_it`"),
        mark(("Table 4.3",), "control/lqr.py", figures=("a",)),
        mark(("Table 4.3",), differs="the plot is lost"),
        mark(("Fig. 1.1",), impossible="a drawing"),
    ]
    assert coverage.check(fine, ROWS) == []
