"""History of one deputy of a recorded run."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from formation_gnc.analysis.sensor_series import Channel, SensorSeries
from formation_gnc.analysis.supervision_history import SupervisionHistory
from formation_gnc.analysis.thinning import Thinned, ThinnedByKey, TickSelection
from formation_gnc.analysis.trajectory import UnseenThrust
from formation_gnc.flight import topics
from formation_gnc.recording.decode import nanoseconds
from formation_gnc.recording.fields import Fields
from formation_gnc.types import Matrix, Vector

HOUR = 3600.0

ECLIPSES = 300
"""Eclipses kept at most."""


class Handler(NamedTuple):
    """Takes the next batch of messages of a topic, with the fields that it needs."""

    add: Callable[[Fields], None]
    fields: tuple[str, ...]


class DeputyHistory:
    """Curves of one deputy, thinned while they are read; times in h.

    Attributes:
        name: of the deputy.
        time: (N,) selected ticks with truth.
        truth: (N, 6) relative states at `time`.
        acceleration: (N, 3) by thrust, over the tick before, m/s^2.
        delta_v: (N,) so far, all axes added, m/s.
        total_delta_v: over all ticks, m/s.
        impulse: (N, 3) by thrust so far, signed, per mass, m/s.
        target, target_time: (L, 6) target states at the selected ticks that have one.
        control_error, control_time: (P, 6) truth minus target, where a selected tick has both.
        estimation_error, estimation_time: (M, 6) estimate minus truth, where a selected tick has both.
        covariance: (K, 6, 6) of the filter.
        sigma, sigma_time: (K, 6) standard deviations of the filter.
        eclipses: begin and end of each.
        readings: (n, 2) time and value by sensor and component.
        innovations: (n, 3) time, value and standard deviation by sensor and component.
        timing: (n, 2) time and compute time (ms) by module.
        solver: (n, 2) time and iterations.
        supervision: modes, faults and responses; times in s.
    """

    def __init__(self, index: int, name: str, selection: TickSelection, unseen: UnseenThrust) -> None:
        """Start empty.

        Args:
            index: place of the deputy in Truth.
            name: of the deputy.
            selection: of the ticks to keep.
            unseen: its thrust over the ticks that truth lacks.
        """
        self._unseen = unseen
        self.name, self._selection, points = name, selection, selection.points
        self._prefix = f"deputies.{index}."
        self._truth = TickColumns("relative_state", "acceleration", "delta_v", "impulse")
        self._estimate, self._target = TickColumns("relative_state", "covariance"), TickColumns("relative_state")
        self._readings, self._innovations = SensorSeries.of_readings(points), SensorSeries.of_innovations(points)
        self._timing, self._solver = ThinnedByKey[str](2, points), Thinned(2, points)
        self._seen_delta_v, self._seen_impulse, self._in_eclipse = 0.0, np.zeros(3), False
        self.eclipses: list[list[float]] = []
        self.supervision = SupervisionHistory()
        self.handlers: dict[str, Handler] = {
            topics.ESTIMATE.name: Handler(self._add_estimate, ("relative_state", "covariance", "innovations")),
            topics.TARGET.name: Handler(self._add_target, ("relative_state",)),
            topics.MEASUREMENT.name: Handler(self._readings.add, ("readings",)),
            topics.STATUS.name: Handler(self._add_status, ("iterations",)),
            topics.MODE.name: Handler(self.supervision.add_modes, ("mode", "reason", "restrictions")),
            topics.HEALTH.name: Handler(self.supervision.add_health, ("statuses",)),
            topics.TIMING.name: Handler(self._add_timing, ("node", "compute_time")),
        }
        """By topic, in the deputy's namespace."""

    def add_truth(self, batch: Fields) -> None:
        """Take the next batch of truths."""
        acceleration = batch[f"{self._prefix}applied_force"] / batch[f"{self._prefix}mass"][:, None]
        tick = self._selection.tick_ns * 1e-9
        seen = self._seen_delta_v + np.cumsum(np.abs(acceleration).sum(axis=1) * tick)
        self._seen_delta_v = float(seen[-1])
        impulse = self._seen_impulse + np.cumsum(acceleration, axis=0) * tick
        self._seen_impulse = impulse[-1]
        total = seen + self._unseen.delta_v_until(batch["stamp_ns"], tick)
        columns = {
            "stamp_ns": batch["stamp_ns"],
            "relative_state": batch[f"{self._prefix}relative_state"],
            "acceleration": acceleration,
            "delta_v": total,
            "impulse": impulse,
        }
        self._truth.add(columns, self._selection(batch["stamp_ns"]))
        self._add_eclipses(batch["time"] / HOUR, batch[f"{self._prefix}eclipse"].astype(bool))

    def _add_eclipses(self, time: Vector, eclipse: NDArray[np.bool_]) -> None:
        state = np.concatenate(([self._in_eclipse], eclipse))
        for row in np.flatnonzero(state[1:] != state[:-1]):
            if state[row + 1]:
                self.eclipses.append([float(time[row]), np.inf])
            else:
                self.eclipses[-1][1] = float(time[row])
        del self.eclipses[ECLIPSES:-1]
        self._in_eclipse = bool(state[-1])

    def _add_estimate(self, batch: Fields) -> None:
        self._estimate.add(batch, self._selection(batch["stamp_ns"]))
        self._innovations.add(batch)

    def _add_target(self, batch: Fields) -> None:
        self._target.add(batch, self._selection(batch["stamp_ns"]))

    def _add_status(self, batch: Fields) -> None:
        self._solver.add(np.column_stack((batch["time"] / HOUR, batch["iterations"])))

    def _add_timing(self, batch: Fields) -> None:
        for module in np.unique(batch["node"].astype(str)):
            own = batch["node"] == module
            rows = np.column_stack((batch["time"][own] / HOUR, 1e-6 * nanoseconds(batch, "compute_time")[own]))
            self._timing.add(str(module), rows)

    def finish(self, end: float) -> None:
        """Derive the curves after the last batch.

        Args:
            end: of the run, h.
        """
        for eclipse in self.eclipses:
            eclipse[1] = min(eclipse[1], end)
        self.supervision.finish(end * HOUR)
        stamps = self._truth["stamp_ns"]
        unseen = self._unseen.delta_v_until(self._unseen.stamps[-1:], self._selection.tick_ns * 1e-9)
        self.total_delta_v = self._seen_delta_v + float(unseen.sum())
        self.time: Vector = stamps / 3.6e12
        self.truth: Matrix = self._truth["relative_state"]
        self.acceleration: Matrix = self._truth["acceleration"]
        self.delta_v: Vector = self._truth["delta_v"]
        self.estimation_error, self.estimation_time = self._minus_truth(stamps, self._estimate)
        negative, self.control_time = self._minus_truth(stamps, self._target)
        self.control_error: Matrix = -negative
        self.impulse: Matrix = self._truth["impulse"]
        self.covariance: Matrix = self._estimate["covariance"].reshape(-1, 6, 6)
        self.sigma: Matrix = np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))
        self.sigma_time: Vector = self._estimate["stamp_ns"] / 3.6e12
        self.target: Matrix = self._target["relative_state"].reshape(-1, 6)
        self.target_time: Vector = self._target["stamp_ns"] / 3.6e12
        self.readings: dict[Channel, Matrix] = self._readings.rows
        self.innovations: dict[Channel, Matrix] = self._innovations.rows
        self.timing: dict[str, Matrix] = self._timing.rows
        self.solver: Matrix = self._solver.rows

    def _minus_truth(self, stamps: NDArray[np.int64], other: "TickColumns") -> tuple[Matrix, Vector]:
        """Relative states of `other` minus the truth, and their times."""
        common, rows, others = np.intersect1d(stamps, other["stamp_ns"], return_indices=True)
        if not len(common):
            return np.zeros((0, 6)), np.zeros(0)
        return other["relative_state"][others] - self.truth[rows], common / 3.6e12


class TickColumns:
    """Selected rows of some fields, collected batch by batch."""

    def __init__(self, *fields: str) -> None:
        """Start without rows of these fields and of their stamps."""
        self._parts: dict[str, list[NDArray[Any]]] = {name: [] for name in ("stamp_ns", *fields)}

    def add(self, columns: Mapping[str, NDArray[Any]], rows: NDArray[np.bool_]) -> None:
        """Add what is selected of the next batch."""
        for name, part in self._parts.items():
            part.append(columns[name][rows])

    def __getitem__(self, name: str) -> NDArray[Any]:
        """All rows of a field."""
        part = self._parts[name]
        return np.concatenate(part) if part else np.zeros(0)
