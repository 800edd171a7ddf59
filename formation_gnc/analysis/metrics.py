"""Figures of merit of a recorded run."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.recording.fields import Fields
from formation_gnc.recording.reader import Bag
from formation_gnc.records import EventKind, kind_name
from formation_gnc.types import Matrix, Times, Vector


@dataclass(frozen=True)
class Trajectory:
    """States of one deputy at the ticks that all of its modules answered."""

    time: Vector
    """(N,) simulated time, s."""
    truth: Matrix
    """(N, 6) true relative states, Hill frame, m and m/s."""
    estimate: Matrix
    """(N, 6) estimated relative states."""
    sigma: Matrix
    """(N, 6) standard deviations from the covariance of the filter."""
    target: Matrix
    """(N, 6) target states."""
    nis: Vector
    """(N,) normalised innovation squared; 0 on ticks without readings."""
    applied: Matrix
    """(M, 3) accelerations by thrust over each tick of the truth, Hill frame, m/s^2."""
    applied_time: Vector
    """(M,) start of each of those ticks, s."""
    tick: float
    """Length of a tick, s."""

    @property
    def error(self) -> Matrix:
        """(N, 3) true position minus target, m."""
        return self.truth[:, :3] - self.target[:, :3]

    @property
    def estimation_error(self) -> Matrix:
        """(N, 6) estimate minus truth."""
        return self.estimate - self.truth

    @property
    def delta_v(self) -> Vector:
        """(3,) delta-v per Hill axis, m/s."""
        return np.asarray(np.abs(self.applied).sum(axis=0) * self.tick)


@dataclass(frozen=True)
class DeputyFigures:
    """Figures of one deputy, by the names that `formation-gnc sil --json` prints."""

    final_error_m: float
    rms_error_m: float
    estimate_rms_m: float
    mean_nis: float
    delta_v_m_s: float
    delta_v_axes_m_s: list[float]


@dataclass(frozen=True)
class RunFigures:
    """Figures of a whole run."""

    ticks: int
    misses: int
    deputies: dict[str, DeputyFigures]


def deputies_of(bag: Bag) -> list[str]:
    """Names of the deputies in a bag, in the order of its truth.

    Raises:
        BagError: no truth.
    """
    if topics.TRUTH.name not in bag.topics or bag.topics[topics.TRUTH.name].count == 0:
        raise BagError(f"{bag.path}: has no truth")
    _, first = next(bag.batches([topics.TRUTH.name], 1))
    count = sum(key.endswith(".name") for key in first)
    return [str(first[f"deputies.{index}.name"][0]) for index in range(count)]


@dataclass(frozen=True)
class UnseenThrust:
    """Thrust of a deputy over the ticks that the recorded truth lacks, as its own avionics measured it."""

    stamps: Times
    """(N,) ends of the ticks, ns, sorted."""
    acceleration: Matrix
    """(N, 3) over each, Hill frame, m/s^2."""

    def delta_v_until(self, stamps: Times, tick: float) -> Vector:
        """(M,) delta-v of the ticks that end at or before each of some stamps (ns), all axes added, m/s."""
        total = np.concatenate(([0.0], np.cumsum(np.abs(self.acceleration).sum(axis=1)))) * tick
        return np.asarray(total[np.searchsorted(self.stamps, stamps, side="right")])


def unseen_thrust(bag: Bag, deputy: str) -> UnseenThrust:
    """Thrust of a deputy over the ticks that the recorded truth lacks and its measurements have."""
    topic = topics.MEASUREMENT.of(deputy)
    stamps = bag.stamps(topic) if topic in bag.topics and bag.topics[topic].count else np.zeros(0, dtype=np.int64)
    missing = ~np.isin(stamps, bag.stamps(topics.TRUTH.name))
    if not missing.any():
        return UnseenThrust(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    measured = bag.arrays(topic, ("applied_force", "mass"))
    acceleration = measured["applied_force"] / measured["mass"][:, None]
    return UnseenThrust(stamps[missing], acceleration[missing])


def trajectory(bag: Bag, deputy: str) -> Trajectory:
    """Trajectory of one deputy.

    Raises:
        BagError: no truth, or no tick with an estimate and a target of this deputy.
    """
    truth = bag.arrays(topics.TRUTH.name, ("deputies",))
    index = deputies_of(bag).index(deputy)
    missing = [topic.name for topic in (topics.ESTIMATE, topics.TARGET) if topic.of(deputy) not in bag.topics]
    if missing:
        raise BagError(f"{bag.path}: has no {' and no '.join(missing)} of {deputy}")
    estimate = bag.arrays(topics.ESTIMATE.of(deputy), ("relative_state", "covariance", "nis"))
    target = bag.arrays(topics.TARGET.of(deputy), ("relative_state",))
    stamps = np.intersect1d(np.intersect1d(truth["stamp_ns"], estimate["stamp_ns"]), target["stamp_ns"])
    if not len(stamps):
        raise BagError(f"{bag.path}: no tick with an estimate and a target of {deputy}")
    rows = {id(part): np.searchsorted(part["stamp_ns"], stamps) for part in (truth, estimate, target)}
    prefix = f"deputies.{index}."
    tick = bag.tick_ns * 1e-9
    unseen = unseen_thrust(bag, deputy)
    ends = np.concatenate((truth["stamp_ns"][1:], unseen.stamps))
    # Truth holds the force of the tick before.
    applied = (truth[f"{prefix}applied_force"] / truth[f"{prefix}mass"][:, None])[1:]
    order = np.argsort(ends, kind="stable")
    covariance = estimate["covariance"][rows[id(estimate)]].reshape(-1, 6, 6)
    return Trajectory(
        time=stamps * 1e-9,
        truth=truth[f"{prefix}relative_state"][rows[id(truth)]],
        estimate=estimate["relative_state"][rows[id(estimate)]],
        sigma=np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)),
        target=target["relative_state"][rows[id(target)]],
        nis=estimate["nis"][rows[id(estimate)]],
        applied=np.concatenate((applied, unseen.acceleration))[order],
        applied_time=ends[order] * 1e-9 - tick,
        tick=tick,
    )


def event_kinds(events: Fields) -> list[str]:
    """Names of the kinds of events, which bags of 0.1.0 have as text.

    Raises:
        BagError: they are neither numbers nor text.
    """
    if events["kind"].dtype.kind == "U":
        return [str(kind) for kind in events["kind"]]
    return [kind_name(kind) for kind in events.integers("kind").tolist()]


def figures(bag: Bag) -> RunFigures:
    """Figures of a run.

    Raises:
        BagError: as for `trajectory`.
    """
    deputies = {}
    for name in deputies_of(bag):
        path = trajectory(bag, name)
        error = np.linalg.norm(path.error, axis=1)
        estimation = np.linalg.norm(path.estimation_error[:, :3], axis=1)
        measured = path.nis[path.nis > 0.0]
        deputies[name] = DeputyFigures(
            final_error_m=float(error[-1]),
            rms_error_m=float(np.sqrt(np.mean(error**2))),
            estimate_rms_m=float(np.sqrt(np.mean(estimation**2))),
            mean_nis=float(measured.mean()) if len(measured) else 0.0,
            delta_v_m_s=float(path.delta_v.sum()),
            delta_v_axes_m_s=path.delta_v.tolist(),
        )
    has_events = topics.EVENTS.name in bag.topics and bag.topics[topics.EVENTS.name].count > 0
    kinds = event_kinds(bag.arrays(topics.EVENTS.name, ("kind",))) if has_events else []
    return RunFigures(bag.topics[topics.TRUTH.name].count, kinds.count(kind_name(EventKind.MISS)), deputies)
