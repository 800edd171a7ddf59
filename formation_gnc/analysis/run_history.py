"""A recorded run as curves to draw: read once, thinned while it is read, for bags of any length."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.analysis.metrics import deputies_of
from formation_gnc.analysis.separation import Separation, minimum_separation
from formation_gnc.recording.decode import nanoseconds
from formation_gnc.recording.reader import Bag
from formation_gnc.records import kind_name
from formation_gnc.types import Matrix, Vector

POINTS = 2000
"""Points that a curve is drawn with, and twice that at most."""

MARKS = 300
"""Events and eclipses that are kept at most, each."""

AXES = ("x radial", "y along-track", "z cross-track")

HOUR = 3600.0

Batch = dict[str, NDArray[Any]]


class Thinned:
    """Rows of numbers in order, every so many-th kept, so that there are never more than twice POINTS."""

    def __init__(self, width: int) -> None:
        """Begin without a row."""
        self.rows: Matrix = np.empty((0, width))
        self._stride, self._seen = 1, 0

    def add(self, rows: Matrix) -> None:
        """Take the next rows."""
        index = np.arange(self._seen, self._seen + len(rows))
        self._seen += len(rows)
        self.rows = np.concatenate((self.rows, rows[index % self._stride == 0]))
        while len(self.rows) > 2 * POINTS:
            self.rows = self.rows[::2]
            self._stride *= 2


class ByName:
    """Thinned rows for each of some names or numbers that turn up."""

    def __init__(self, width: int) -> None:
        """Begin without a name."""
        self._width = width
        self._found: dict[Any, Thinned] = {}

    def add(self, name: Any, rows: Matrix) -> None:
        """Take the next rows of a name."""
        self._found.setdefault(name, Thinned(self._width)).add(rows)

    @property
    def rows(self) -> dict[Any, Matrix]:
        """Rows by name, in the names' order."""
        return {name: self._found[name].rows for name in sorted(self._found)}


@dataclass(frozen=True)
class Mark:
    """An event, as a mark on a time axis: time in h."""

    time: float
    kind: str
    node: str
    subject: str
    detail: str


class Ticks:
    """Chooses every so many-th tick, the same ticks for every topic."""

    def __init__(self, bag: Bag) -> None:
        """Choose by the number of truths and the time between the first two."""
        first = [stamp for _, _, stamp in islice(bag.messages(["/truth"]), 2)]
        self._start, self.tick_ns = first[0], first[-1] - first[0]
        self._step = max(1, self.tick_ns * -(-bag.topics["/truth"].count // POINTS))

    def __call__(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which of the stamps to keep."""
        kept: NDArray[np.bool_] = (stamps - self._start) % self._step == 0
        return kept


class _Columns:
    """Rows of some fields, gathered batch by batch."""

    def __init__(self, *fields: str) -> None:
        self._parts: dict[str, list[NDArray[Any]]] = {name: [] for name in ("stamp_ns", *fields)}

    def add(self, batch: Batch, rows: NDArray[np.bool_]) -> None:
        for name, part in self._parts.items():
            part.append(batch[name][rows])

    def __getitem__(self, name: str) -> NDArray[Any]:
        part = self._parts[name]
        return np.concatenate(part) if part else np.zeros(0)


class DeputyHistory:
    """What is drawn of one deputy; times in h.

    truth: (N, 6) relative states at `time`; acceleration, delta_v: (N, 3) and (N,) by thrust over the tick
    before, and so far. error, error_time: (M, 6) estimate minus truth. sigma, sigma_time: (K, 6) standard
    deviations by the filter. target: (L, 6), as it came; control, control_time: truth minus target.
    eclipses: begin and end of each. readings, innovations: time and values by sensor. timing: time and
    compute time (ms) by node. solver: time and iterations.
    """

    def __init__(self, index: int, name: str, ticks: Ticks) -> None:
        """Listen, and know nothing yet."""
        self.name, self._ticks = name, ticks
        self._prefix = f"deputies.{index}."
        self._truth = _Columns(f"{self._prefix}relative_state", "acceleration", "delta_v")
        self._estimate, self._target = _Columns("relative_state", "covariance"), _Columns("relative_state")
        self._readings, self._innovations = ByName(2), ByName(3)
        self._timing, self._solver = ByName(2), Thinned(2)
        self.spent, self._dark = 0.0, False
        self.eclipses: list[list[float]] = []
        self.listeners: dict[str, Callable[[Batch], None]] = {
            "estimate": self._on_estimate,
            "target": lambda batch: self._target.add(batch, ticks(batch["stamp_ns"])),
            "measurement": lambda batch: _sort_by_sensor(batch, ("reading",), self._readings),
            "status": self._on_status,
            "timing": self._on_timing,
        }

    def on_truth(self, batch: Batch) -> None:
        """Take the next truths."""
        acceleration = batch[f"{self._prefix}applied_force"] / batch[f"{self._prefix}mass"][:, None]
        steps = np.abs(acceleration).sum(axis=1) * self._ticks.tick_ns * 1e-9
        total = self.spent + np.cumsum(steps)
        self.spent = float(total[-1])
        more = {"acceleration": acceleration, "delta_v": total}
        self._truth.add(batch | more, self._ticks(batch["stamp_ns"]))
        shadow = np.concatenate(([self._dark], batch[f"{self._prefix}eclipse"].astype(bool)))
        for row in np.flatnonzero(shadow[1:] != shadow[:-1]):
            time = float(batch["time"][row]) / HOUR
            if shadow[row + 1]:
                self.eclipses.append([time, np.inf])
            else:
                self.eclipses[-1][1] = time
        del self.eclipses[MARKS:-1]
        self._dark = bool(shadow[-1])

    def _on_estimate(self, batch: Batch) -> None:
        self._estimate.add(batch, self._ticks(batch["stamp_ns"]))
        _sort_by_sensor(batch, ("innovation", "innovation_sigma"), self._innovations)

    def _on_status(self, batch: Batch) -> None:
        self._solver.add(np.column_stack((batch["time"] / HOUR, batch["iterations"])))

    def _on_timing(self, batch: Batch) -> None:
        for node in np.unique(batch["node"].astype(str)):
            own = batch["node"] == node
            rows = np.column_stack((batch["time"][own] / HOUR, 1e-6 * nanoseconds(batch, "compute_time")[own]))
            self._timing.add(str(node), rows)

    def finish(self, end: float) -> None:
        """All has been read, up to a time in h."""
        for eclipse in self.eclipses:
            eclipse[1] = min(eclipse[1], end)
        stamps = self._truth["stamp_ns"]
        self.time: Vector = stamps / 3.6e12
        self.truth: Matrix = self._truth[f"{self._prefix}relative_state"]
        self.acceleration: Matrix = self._truth["acceleration"]
        self.delta_v: Vector = self._truth["delta_v"]
        self.error, self.error_time = self._against_truth(stamps, self._estimate)
        opposite, self.control_time = self._against_truth(stamps, self._target)
        self.control: Matrix = -opposite
        covariance = self._estimate["covariance"].reshape(-1, 6, 6)
        self.sigma: Matrix = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        self.sigma_time: Vector = self._estimate["stamp_ns"] / 3.6e12
        self.target: Matrix = self._target["relative_state"].reshape(-1, 6)
        self.readings, self.innovations = self._readings.rows, self._innovations.rows
        self.timing, self.solver = self._timing.rows, self._solver.rows

    def _against_truth(self, stamps: NDArray[np.int64], other: _Columns) -> tuple[Matrix, Vector]:
        both, rows, others = np.intersect1d(stamps, other["stamp_ns"], return_indices=True)
        if not len(both):
            return np.zeros((0, 6)), np.zeros(0)
        return other["relative_state"][others] - self.truth[rows], both / 3.6e12


class RunHistory:
    """A recorded run. Raises ConfigurationError when the bag has no truth.

    deputies: by name. events: the first MARKS of the run; counts: all of them, by kind. distances: time (h)
    and distance (m) by pair of deputies, thinned; nearest: the nearest approach on any tick, none for a
    single deputy.
    """

    def __init__(self, bag: Bag) -> None:
        """Read the bag, once."""
        names = deputies_of(bag)
        self.ticks = Ticks(bag)
        self.deputies = {name: DeputyHistory(i, name, self.ticks) for i, name in enumerate(names)}
        self.events: list[Mark] = []
        self.counts: Counter[str] = Counter()
        self.nearest: Separation | None = None
        self._distances = ByName(2)
        listeners: dict[str, Callable[[Batch], None]] = {"/truth": self._on_truth, "/events": self._on_events}
        for name, deputy in self.deputies.items():
            listeners |= {f"/{name}/{topic}": hear for topic, hear in deputy.listeners.items()}
        for topic, batch in bag.batches([topic for topic in listeners if topic in bag.topics]):
            listeners[topic](batch)
        for deputy in self.deputies.values():
            deputy.finish(bag.end_ns / 3.6e12)
        self.distances: dict[tuple[str, str], Matrix] = self._distances.rows

    def events_of(self, deputy: str) -> list[Mark]:
        """Events of a deputy's own nodes, and those of the run about it or about no deputy."""

        def concerns(mark: Mark) -> bool:
            owner = mark.node.split("/")[1:-1]
            if owner:
                return owner == [deputy]
            return mark.subject == deputy or mark.subject not in self.deputies

        return [mark for mark in self.events if concerns(mark)]

    def _on_truth(self, batch: Batch) -> None:
        for deputy in self.deputies.values():
            deputy.on_truth(batch)
        names = list(self.deputies)
        places = [batch[f"deputies.{index}.relative_state"][:, :3] for index in range(len(names))]
        nearest = minimum_separation(batch["time"], np.array(places), names)
        if nearest is not None and (self.nearest is None or nearest.distance < self.nearest.distance):
            self.nearest = nearest
        for one, other in combinations(range(len(names)), 2):
            apart = np.linalg.norm(places[one] - places[other], axis=1)
            self._distances.add((names[one], names[other]), np.column_stack((batch["time"] / HOUR, apart)))

    def _on_events(self, batch: Batch) -> None:
        kinds = [kind_name(int(kind)) for kind in batch["kind"]]
        self.counts.update(kinds)
        rows = zip(batch["time"], kinds, batch["node"], batch["subject"], batch["detail"], strict=True)
        for time, kind, *texts in islice(rows, MARKS - len(self.events)):
            self.events.append(Mark(float(time) / HOUR, kind, *map(str, texts)))


def _sort_by_sensor(batch: Batch, fields: Sequence[str], into: ByName) -> None:
    """Add rows of time (h) and values to each sensor's."""
    found: dict[int, list[list[float]]] = {}
    for row in np.flatnonzero([len(sensors) > 0 for sensors in batch["sensor"]]):
        time = float(batch["time"][row]) / HOUR
        values = [batch[name][row] for name in fields]
        for place, sensor in enumerate(batch["sensor"][row]):
            if all(place < len(each) for each in values):
                found.setdefault(int(sensor), []).append([time, *(float(each[place]) for each in values)])
    for sensor, rows in found.items():
        into.add(sensor, np.array(rows))
