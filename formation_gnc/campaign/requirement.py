"""Requirements: statements on a figure of every flight, or on the mean of a figure over all flights."""

import re
from collections.abc import Collection
from dataclasses import dataclass

from formation_gnc.campaign.flight_figures import BANDS, EXPRESSIONS, NUMBERS, TITLES, WITHIN_TITLE, within_name
from formation_gnc.errors import ConfigurationError, nearest

FORM = (
    "`FIGURE < NUMBER in P % at C % confidence`, `FIGURE inside its band in P % at C % confidence` or "
    "`mean FIGURE inside its band at C % confidence`"
)

_PERCENT = r"(?P<{}>[0-9.]+) %"
_COMPARED = r"(?P<relation><=?|>=?) (?P<limit>[-+0-9.eE]+)"
_SHARE = f" in {_PERCENT.format('share')} at {_PERCENT.format('confidence')} confidence"
_STATEMENT = re.compile(rf"(?P<figure>.+?) (?:{_COMPARED}|(?P<band>inside its band)){_SHARE}")
_MEAN = re.compile(rf"mean (?P<figure>.+?) inside its band at {_PERCENT.format('confidence')} confidence")
_WITHIN = re.compile(WITHIN_TITLE.format(r"([0-9.eE+]+)"))
_WITHIN_NAME = re.compile(r"time_within_(.+)_m_s$")


@dataclass(frozen=True)
class Requirement:
    """A statement on the flights of a campaign.

    Attributes:
        text: as in the file.
        figure: name of the column, with the name of a deputy before it for that one alone.
        relation: one of < <= > >=, or "band".
        limit: that the figure is compared with; NaN for a band.
        share: of the flights that are to meet it; NaN for a mean over all flights.
        confidence: of the verdict.
    """

    text: str
    figure: str
    relation: str
    limit: float
    share: float
    confidence: float

    @property
    def of_mean(self) -> bool:
        """Whether it is on the mean over all flights."""
        return self.share != self.share

    @property
    def within(self) -> float | None:
        """Distance (m) of a `time to within`; None for any other figure."""
        found = _WITHIN_NAME.search(self.figure)
        return float(found[1]) if found else None


def requirement_of(text: str, deputies: Collection[str]) -> Requirement:
    """Requirement from its words.

    Args:
        text: of the form FORM; a figure by its name or its title.
        deputies: whose figures there are.

    Raises:
        ConfigurationError: another form, an unknown figure, or numbers that are not allowed.
    """
    words = " ".join(str(text).split())
    found = _STATEMENT.fullmatch(words)
    mean = None if found else _MEAN.fullmatch(words)
    parts = (found or mean).groupdict() if found or mean else None  # type: ignore[union-attr]
    if parts is None:
        raise ConfigurationError(f"requirement {text!r}: is not allowed; it must be like {FORM}")
    band = mean is not None or parts.get("band") is not None
    figure = _figure(words, str(parts["figure"]), deputies, band)
    try:
        limit = float("nan") if band else float(parts["limit"])
        share = float(parts.get("share", "nan")) / 100.0
        confidence = float(parts["confidence"]) / 100.0
    except ValueError as error:
        raise ConfigurationError(f"requirement {text!r}: {error}") from None
    for name, value in {"share": share, "confidence": confidence}.items():
        if not 0.0 < value < 1.0 and not (mean and name == "share"):
            raise ConfigurationError(
                f"requirement {text!r}: {name} is not allowed; it must be above 0 % and below 100 %"
            )
    return Requirement(words, figure, "band" if band else str(parts["relation"]), limit, share, confidence)


def _figure(text: str, words: str, deputies: Collection[str], band: bool) -> str:
    """Name of the column of a figure given by name or title, perhaps with a deputy before it."""
    deputy, dot, rest = words.partition(".")
    prefix, words = (f"{deputy}.", rest) if dot and deputy in deputies else ("", words)
    within = _WITHIN.fullmatch(words)
    name = within_name(float(within[1])) if within else TITLES.get(words, TITLES.get(f"mean {words}", words))
    known = BANDS if band else {*NUMBERS, *EXPRESSIONS}
    if name not in known and not (within and not band):
        kind = "figure with a band" if band else "figure"
        raise ConfigurationError(f"requirement {text!r}: {kind} {words!r} is unknown; {nearest(words, [*known])}")
    return prefix + name
