"""Figures of one flight, taken from its records while it flies, with nothing recorded.

Those of the summary are computed by the code that computes them from a bag, on the same numbers, to the same bits.
"""

from dataclasses import asdict
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import gammaincinv

from formation_gnc.analysis.figures import DeputyFigures, deputy_figures
from formation_gnc.analysis.trajectory import Trajectory, UnseenThrust, assemble, period_of
from formation_gnc.analysis.verdict import Verdict
from formation_gnc.flight import topics
from formation_gnc.recording.fields import Fields
from formation_gnc.records import Estimate, EstimateStatus, Event, EventKind
from formation_gnc.sil.monte_carlo import nees
from formation_gnc.types import Matrix, Vector

NUMBERS = (
    *(name for name, kind in DeputyFigures.__annotations__.items() if kind in (float, int)),
    *(f"delta_v_{axis}_m_s" for axis in "xyz"),
)
"""Figures of the summary that are numbers, each a column for each deputy."""

EXPRESSIONS = {
    "largest_error_last_orbit_m": "largest position error in the last orbit",
    "delta_v_per_orbit_m_s": "delta-v per orbit",
    "nees_ratio": "mean NEES",
    "nearest_approach_m": "nearest approach",
    "detections": "faults detected",
}
"""Figures over time with their titles: those of the run as a whole, and of each deputy."""

OF_RUN = "nearest_approach_m", "detections"
"""Figures of the run as a whole."""

WITHIN_TITLE = "time to within {} m"

TITLES = {title: name for name, title in EXPRESSIONS.items()} | {"mean NIS": "nis_ratio"}
"""Names of figures by their titles."""

BANDS = {"nis_ratio": "nis_values", "nees_ratio": "nees_values"}
"""Figures with a band, sums of chi-square variables over what is expected, and the columns of their freedom."""

CURVE = 200
"""Points of an error over time at most."""

_NO_STAMPS = np.zeros(0, dtype=np.int64)
_UNSEEN = UnseenThrust(_NO_STAMPS, np.zeros((0, 3)))


def within_name(distance: float) -> str:
    """Column of the time (s) from which a deputy stays within a distance (m) of its target."""
    return f"time_within_{distance:g}_m_s"


def band(freedom: float) -> tuple[float, float]:
    """Bounds, with 99.73 %, of a chi-square variable over its freedom."""
    low, high = (2.0 * gammaincinv(freedom / 2.0, [0.00135, 0.99865]) / freedom).tolist()
    return low, high


class _Rows:
    """Rows of numbers with their stamps (ns), in memory made at once."""

    def __init__(self, ticks: int, width: int) -> None:
        self._stamps, self._rows, self._count = np.zeros(ticks, dtype=np.int64), np.zeros((ticks, width)), 0

    def add(self, stamp: int, *parts: Any) -> None:
        row, begin = self._rows[self._count], 0
        self._stamps[self._count] = stamp
        for part in parts:
            end = begin + len(part)
            row[begin:end] = part
            begin = end
        self._count += 1

    def last(self, count: int) -> Vector:
        """The first numbers of the last row."""
        return self._rows[self._count - 1, :count]

    @property
    def stamps(self) -> Any:
        return self._stamps[: self._count]

    def columns(self, begin: int, end: int) -> Matrix:
        return np.ascontiguousarray(self._rows[: self._count, begin:end])

    def column(self, number: int) -> Vector:
        return np.ascontiguousarray(self._rows[: self._count, number])


class _Deputy:
    """Records of one deputy."""

    def __init__(self, ticks: int) -> None:
        self.truth, self.estimates, self.targets = _Rows(ticks, 10), _Rows(ticks, 14), _Rows(ticks, 6)
        self.thrusts, self.statuses = _Rows(ticks, 3), _Rows(ticks, 4)
        self.law = ""
        self._nees: list[float] = []

    def take(self, topic: str, record: Any) -> None:
        if topic == topics.ESTIMATE.name:
            used = sum(len(each.values) for each in record.innovations if not each.rejection)
            sigma = np.sqrt(np.diagonal(record.covariance))
            self.estimates.add(record.time, record.relative_state, sigma, (record.nis, used))
            if record.status == EstimateStatus.TRACKING and used:
                self._nees.append(self._nees_of(record))
        elif topic == topics.TARGET.name:
            self.targets.add(record.time, record.relative_state)
        elif topic == topics.THRUST.name:
            self.thrusts.add(record.time, record.force)
        elif topic == topics.STATUS.name:
            self.statuses.add(record.time, record.saturated, (record.fallback != "",))
            self.law = record.algorithm

    def _nees_of(self, estimate: Estimate) -> float:
        try:
            return nees(estimate, self.truth.last(6))
        except np.linalg.LinAlgError:
            return float("nan")

    @property
    def nees_ratio(self) -> float:
        """Mean normalised estimation error squared over its expectation, at the ticks with readings used."""
        return float(np.mean(self._nees)) / 6.0 if self._nees else float("nan")

    def trajectory(self, name: str, tick: float, period: float) -> Trajectory:
        statuses, truth = self.statuses, self.truth
        columns: dict[Any, Any] = {
            topics.ESTIMATE: (
                self.estimates.stamps,
                self.estimates.columns(0, 6),
                self.estimates.columns(6, 12),
                self.estimates.column(12),
                self.estimates.column(13),
            ),
            topics.TARGET: (self.targets.stamps, self.targets.columns(0, 6)),
            topics.THRUST: (self.thrusts.stamps * 1e-9, np.abs(self.thrusts.columns(0, 3)).sum(axis=1)),
            topics.STATUS: (
                statuses.columns(0, 3).astype(bool).any(axis=1),
                statuses.column(3).astype(bool),
                np.array([self.law] if self.law else []),
            ),
        }
        states = truth.stamps, truth.columns(0, 6), truth.columns(6, 9), truth.column(9)
        return assemble(name, columns, states, _UNSEEN, tick, period)


class FlightRecord:
    """Sink of a flight that keeps what its figures take."""

    def __init__(self, deputies: tuple[str, ...], ticks: int, tick: float) -> None:
        """Make room.

        Args:
            deputies: names.
            ticks: of the flight.
            tick: s.
        """
        self._deputies = {name: _Deputy(ticks) for name in deputies}
        self._by_topic = {
            f"/{name}/{topic.name}": (deputy, topic.name)
            for name, deputy in self._deputies.items()
            for topic in (topics.ESTIMATE, topics.TARGET, topics.THRUST, topics.STATUS)
        }
        self._events: list[Event] = []
        self._ticks, self._tick, self._period = ticks, tick, 0.0
        self._nearest = float("inf")

    def __call__(self, topic: str, record: Any) -> None:
        """Take a record."""
        if topic in self._by_topic:
            deputy, name = self._by_topic[topic]
            deputy.take(name, record)
        elif topic == topics.TRUTH.name:
            if not self._period:
                self._period = period_of(record.chief_state)
            positions = [(0.0, 0.0, 0.0)]
            for each in record.deputies:
                self._deputies[each.name].truth.add(record.time, each.relative_state, each.applied_force, (each.mass,))
                positions.append(each.relative_state[:3].tolist())
            for one, other in combinations(positions, 2):
                squared = sum((a - b) ** 2 for a, b in zip(one, other, strict=True))
                self._nearest = min(self._nearest, squared)
        elif topic == topics.EVENTS.name:
            self._events.append(record)

    @np.errstate(all="ignore")  # a flight that is lost may go anywhere
    def figures(self, within: tuple[float, ...] = ()) -> dict[str, Any]:
        """Figures of the flight by column; `within`: distances (m) of the times to be within them."""
        events = self._events_as_fields()
        row: dict[str, Any] = {}
        verdicts = []
        for name, deputy in self._deputies.items():
            path = deputy.trajectory(name, self._tick, self._period)
            summary = deputy_figures(name, path, events)
            verdicts.append(summary.verdict)
            own = asdict(summary)
            for axis, value in zip("xyz", own.pop("delta_v_axes_m_s"), strict=True):
                own[f"delta_v_{axis}_m_s"] = value
            del own["nis_band"]
            own["nis_values"] = float(path.innovations.sum())
            own |= {"nees_ratio": deputy.nees_ratio, "nees_values": 6.0}
            own |= _over_time(path, summary, within)
            row |= {f"{name}.{figure}": value for figure, value in own.items()}
        row["nearest_approach_m"] = float(np.sqrt(self._nearest))
        for column, kind in (("misses", EventKind.MISS), ("detections", EventKind.DETECTION)):
            row[column] = sum(event.kind == kind for event in self._events)
        row["verdict"] = str(max(verdicts, key=list(Verdict).index))
        return row

    def curves(self) -> dict[str, Matrix]:
        """(P, 3) true position minus target by deputy at the times of `curve_ticks`; NaN where there was no answer."""
        ticks = curve_ticks(self._ticks)
        curves = {}
        for name, deputy in self._deputies.items():
            path = deputy.trajectory(name, self._tick, self._period)
            whole = np.full((self._ticks, 3), np.nan)
            whole[np.round(path.time / self._tick).astype(int)] = path.error
            curves[name] = whole[ticks]
        return curves

    def _events_as_fields(self) -> Fields | None:
        if not self._events:
            return None
        columns = {
            "time": np.array([event.time for event in self._events], dtype=np.int64) * 1e-9,
            "kind": np.array([event.kind for event in self._events], dtype=np.int64),
            "node": np.array([event.node for event in self._events]),
        }
        return Fields("flight", columns)


def curve_ticks(ticks: int) -> Any:
    """Ticks of a flight at which its error over time is kept."""
    return np.unique(np.linspace(0, ticks - 1, min(ticks, CURVE)).round().astype(int))


def _over_time(path: Trajectory, summary: DeputyFigures, within: tuple[float, ...]) -> dict[str, float]:
    """Expressions over time of one deputy."""
    error = np.linalg.norm(path.error, axis=1)
    end = float(path.applied_time[-1]) if len(path.applied_time) else 0.0
    last = path.time > end - path.period
    found = {
        "largest_error_last_orbit_m": float(error[last].max()) if last.any() else float("inf"),
        "delta_v_per_orbit_m_s": summary.delta_v_m_s * path.period / (end + path.tick),
    }
    for distance in within:
        outside = np.flatnonzero(~(error <= distance))
        settled = 0 if not len(outside) else int(outside[-1]) + 1
        found[within_name(distance)] = float(path.time[settled]) if settled < len(error) else float("inf")
    return found
