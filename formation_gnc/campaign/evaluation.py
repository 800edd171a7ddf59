"""What a campaign's data set says: verdicts, dispersions that were not applied, what hurts, paired differences."""

from dataclasses import dataclass
from math import nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from formation_gnc.campaign.case import CASE, REASON, nominal_scenario
from formation_gnc.campaign.dataset import Dataset
from formation_gnc.campaign.definition import Campaign
from formation_gnc.campaign.flight_figures import BANDS, NUMBERS, OF_RUN, band
from formation_gnc.campaign.order_statistics import Verdict, allowed_failures, bound, runs_needed, verdict
from formation_gnc.campaign.requirement import Requirement
from formation_gnc.types import Vector


class NotAppliedError(RuntimeError):
    """A dispersion has the same value in all flights."""


@dataclass(frozen=True)
class Outcome:
    """Verdict on a requirement in one configuration.

    Attributes:
        requirement: its words.
        configuration: its name.
        verdict: met, not met, or not enough runs.
        runs: flights.
        failures: of them; of a mean over all, 0 or 1.
        allowed: most failures with which it is met.
        needed: runs with which it is met if no more fail; None for a mean.
        bound: value that the share of all flights keeps with the confidence, or the mean; None with too few runs.
        margin: from the bound to the limit, positive on the good side; of a mean to its band, likewise.
        worst: case that is furthest on the bad side; None of a mean.
    """

    requirement: str
    configuration: str
    verdict: Verdict
    runs: int
    failures: int
    allowed: int
    needed: int | None
    bound: float | None
    margin: float | None
    worst: int | None


@dataclass(frozen=True)
class Values:
    """A figure of all flights of a configuration, by case."""

    cases: Any
    values: Vector
    reasons: Any
    """Why a case has no figure; empty for those that have."""


class Flights:
    """A campaign's flights, read column by column."""

    def __init__(self, campaign: Campaign, results: Dataset) -> None:
        """Read nothing yet."""
        self.campaign, self.results = campaign, results
        self.names = results.names()
        self.deputies = {each.name: nominal_scenario(campaign, each).plant.deputies for each in campaign.configurations}
        """By configuration."""

    def column(self, name: str, configuration: str) -> Values:
        """A column of one configuration; NaN where it has no value."""
        table = self.results.table([name, REASON], runs=self.campaign.runs, flights=configuration)
        values = np.array([nan if each is None else float(each) for each in table[name].to_pylist()], dtype=float)
        return Values(table[CASE].to_numpy(), values, np.array(table[REASON].to_pylist(), dtype=object))

    def figure(self, name: str, configuration: str, upper: bool = True) -> Values:
        """A figure; of several deputies that of the one which is worst off.

        Args:
            name: of the figure, or of that of one deputy.
            configuration: its name.
            upper: whether large values are bad.
        """
        columns = self._columns(name, configuration)
        found = [self.column(each, configuration) for each in columns]
        both = np.array([each.values for each in found])
        missing = np.isnan(both).any(axis=0)
        worst = both.max(axis=0, initial=-np.inf) if upper else both.min(axis=0, initial=np.inf)
        return Values(found[0].cases, np.where(missing, nan, worst), found[0].reasons)

    def _columns(self, name: str, configuration: str) -> list[str]:
        deputies = self.deputies[configuration]
        own = name in OF_RUN or name.partition(".")[0] in deputies
        return [name] if own else [f"{deputy}.{name}" for deputy in deputies]

    def outcomes(self) -> list[Outcome]:
        """Verdict on every requirement in every configuration."""
        return [
            self._outcome_of_mean(requirement, each.name)
            if requirement.of_mean
            else self._outcome(requirement, each.name)
            for requirement in self.campaign.requirements
            for each in self.campaign.configurations
        ]

    def _outcome(self, requirement: Requirement, configuration: str) -> Outcome:
        upper = not requirement.relation.startswith(">")
        if requirement.relation == "band":
            figure, limit = self._outside(requirement.figure, configuration), 0.0
        else:
            figure, limit = self.figure(requirement.figure, configuration, upper), requirement.limit
        relation = "<=" if requirement.relation == "band" else requirement.relation
        good = _RELATIONS[relation](figure.values, limit) & ~np.isnan(figure.values)
        runs, failures = len(good), int((~good).sum())
        limits = requirement.share, requirement.confidence
        reached = bound(figure.values, *limits, upper)
        margin = None if reached is None else (limit - reached if upper else reached - limit)
        ranked = np.where(np.isnan(figure.values), np.inf, figure.values if upper else -figure.values)
        return Outcome(
            requirement.text,
            configuration,
            verdict(failures, runs, *limits),
            runs,
            failures,
            allowed_failures(runs, *limits),
            runs_needed(failures, *limits),
            reached,
            margin,
            int(figure.cases[int(ranked.argmax())]) if runs else None,
        )

    def _outside(self, name: str, configuration: str) -> Values:
        """How far each flight is outside the band of a figure, of the deputy which is furthest; 0 inside."""
        worst: Values | None = None
        for column in self._columns(name, configuration):
            ratio, freedom = self._with_freedom(column, configuration)
            bounds = np.array([band(each) if each > 0.0 else (nan, nan) for each in freedom.values]).reshape(-1, 2)
            beyond = np.maximum(np.maximum(bounds[:, 0] - ratio.values, ratio.values - bounds[:, 1]), 0.0)
            found = Values(ratio.cases, beyond, ratio.reasons)
            worst = found if worst is None else Values(worst.cases, np.maximum(worst.values, beyond), worst.reasons)
        assert worst is not None, "a flight has a deputy"
        return worst

    def _with_freedom(self, column: str, configuration: str) -> tuple[Values, Values]:
        deputy, _, name = column.rpartition(".")
        return self.column(column, configuration), self.column(f"{deputy}.{BANDS[name]}", configuration)

    def _outcome_of_mean(self, requirement: Requirement, configuration: str) -> Outcome:
        """Mean of a chi-square variable over all flights, against the band of its freedom, with the confidence."""
        from scipy.stats import chi2

        total, freedom, runs, lost = 0.0, 0.0, 0, 0
        for column in self._columns(requirement.figure, configuration):
            ratio, weight = self._with_freedom(column, configuration)
            good = ~np.isnan(ratio.values * weight.values)
            total += float(ratio.values[good] @ weight.values[good])
            freedom += float(weight.values[good].sum())
            runs, lost = len(good), max(lost, int((~good).sum()))
        alarm = 1.0 - requirement.confidence
        low, high = (
            (chi2.ppf(alarm / 2.0, freedom) / freedom, chi2.isf(alarm / 2.0, freedom) / freedom)
            if freedom
            else (nan, nan)
        )
        mean = total / freedom if freedom else nan
        margin = min(mean - low, high - mean)
        inside = not lost and margin > 0.0
        shown = Verdict.MET if inside else Verdict.NOT_MET if runs else Verdict.NOT_ENOUGH_RUNS
        return Outcome(
            requirement.text, configuration, shown, runs, int(not inside), 0, None, mean, float(margin), None
        )

    def drawn(self) -> list[str]:
        """Columns of numbers that were drawn."""
        begins = [each.name for each in self.campaign.dispersions] + [
            f"faults.{each.name}" for each in self.campaign.faults
        ]
        return [name for name in self.names if any(_is_of(name, begin) for begin in begins)]

    def check_drawn(self) -> None:
        """Raise NotAppliedError for a dispersion with the same value in all flights."""
        if self.campaign.runs < 2:
            return
        names = [each.name for each in self.campaign.dispersions] + [
            f"faults.{each.name}" for each in self.campaign.faults
        ]
        for name in names:
            columns = [column for column in self.names if _is_of(column, name)]
            first = self.campaign.configurations[0].name
            table = self.results.table(columns, runs=self.campaign.runs, flights=first)
            if len(table) > 1 and all(len(set(table[column].to_pylist())) < 2 for column in columns):
                raise NotAppliedError(
                    f"dispersion {name}: has the same value in all {len(table)} flights: it was not applied"
                )


_RELATIONS: dict[str, Any] = {"<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal}


def _is_of(column: str, name: str) -> bool:
    return column == name or (column.startswith(name) and column[len(name)] in "[.")


@dataclass(frozen=True)
class Correlation:
    """How a drawn value goes with a figure over all flights."""

    drawn: str
    figure: str
    rank: float
    """Spearman's rank correlation."""
    chance: float
    """Probability of one as large without any relation."""
    is_distance: bool = False
    """Whether of the drawn value's distance from its median: too much and too little go the same way."""

    @property
    def words(self) -> str:
        """What goes with the figure."""
        return f"distance of {self.drawn} from its median" if self.is_distance else self.drawn


def correlations(flights: Flights, figure: str, configuration: str, upper: bool = True) -> list[Correlation]:
    """Rank correlations of all drawn numbers, or of their distance from the median, with a figure, the strongest first.

    Of the two, the stronger counts; that it was chosen of two doubles its probability by chance (Bonferroni).
    """
    from scipy.stats import spearmanr

    values = flights.figure(figure, configuration, upper).values
    found = []
    for name in flights.drawn():
        try:
            drawn = flights.column(name, configuration).values
        except ValueError:
            continue  # words
        good = np.isfinite(drawn) & np.isfinite(values)
        if good.sum() > 2 and np.ptp(drawn[good]) > 0.0 and np.ptp(values[good]) > 0.0:
            distance = np.abs(drawn - np.median(drawn[good]))
            both = [(spearmanr(each[good], values[good]), each is distance) for each in (drawn, distance)]
            rank, is_distance = max(both, key=lambda each: np.nan_to_num(abs(each[0].statistic)))
            chance = min(1.0, 2.0 * float(rank.pvalue))
            found.append(Correlation(name, figure, float(rank.statistic), chance, is_distance))
    return sorted(found, key=lambda each: -abs(each.rank))


@dataclass(frozen=True)
class Difference:
    """Figure of a configuration minus that of the first, on the same cases."""

    configuration: str
    reference: str
    figure: str
    mean: float
    low: float
    high: float
    """Mean with its interval of 95 % confidence."""
    better: float
    """Share of the cases in which it is less."""
    cases: int


def differences(flights: Flights, figure: str, upper: bool = True) -> list[Difference]:
    """Paired differences of a figure to the first configuration."""
    first, *others = (each.name for each in flights.campaign.configurations)
    found = (difference(flights, figure, name, first, upper) for name in others)
    return [each for each in found if each is not None]


def difference(
    flights: Flights, figure: str, configuration: str, reference: str, upper: bool = True
) -> Difference | None:
    """Paired difference of a figure between two configurations; None with fewer than two pairs."""
    from scipy.stats import t

    one, other = (flights.figure(figure, name, upper) for name in (configuration, reference))
    _, here, there = np.intersect1d(one.cases, other.cases, return_indices=True)
    pairs = one.values[here] - other.values[there]
    pairs = pairs[np.isfinite(pairs)]
    if len(pairs) < 2:
        return None
    mean = float(pairs.mean())
    half = float(t.ppf(0.975, len(pairs) - 1)) * float(pairs.std(ddof=1)) / sqrt(len(pairs))
    return Difference(
        configuration, reference, figure, mean, mean - half, mean + half, float(np.mean(pairs < 0.0)), len(pairs)
    )


def departing_figures(results: Dataset, case: int, configuration: str, bag: Path) -> list[str] | None:
    """Figures of a recorded flight that are not, bit for bit, those of its case; None if the case is not there."""
    from formation_gnc.analysis.figures import figures
    from formation_gnc.recording.reader import Bag

    names = [name for name in results.names() if name.rpartition(".")[2] in NUMBERS]
    rows = [row for row in results.table(names, flights=configuration).to_pylist() if row[CASE] == case]
    if not rows:
        return None
    flown = {
        f"{deputy}.{name}": value
        for deputy, each in figures(Bag(bag)).deputies.items()
        for name, value in each.by_name().items()
    }
    return [name for name in names if rows[0][name] != flown[name]]
