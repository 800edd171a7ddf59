"""Trajectories of a recorded run."""

from dataclasses import dataclass
from math import sqrt, tau

import numpy as np

from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.orbit.constants import MU
from formation_gnc.recording.fields import Fields
from formation_gnc.recording.reader import Bag
from formation_gnc.records import kind_name
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
    innovations: Vector
    """(N,) number of scalar innovations used at the tick."""
    applied: Matrix
    """(M, 3) accelerations by thrust over each tick of the truth, Hill frame, m/s^2."""
    applied_time: Vector
    """(M,) start of each of those ticks, s."""
    tick: float
    """Length of a tick, s."""
    period: float
    """Period of the chief's orbit at the start, s."""

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


def has_messages(bag: Bag, topic: str) -> bool:
    """Whether a bag has a message of a topic."""
    return topic in bag.topics and bag.topics[topic].count > 0


def deputies_of(bag: Bag) -> list[str]:
    """Names of the deputies in a bag, in the order of its truth.

    Raises:
        BagError: no truth.
    """
    if not has_messages(bag, topics.TRUTH.name):
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
    stamps = bag.stamps(topic) if has_messages(bag, topic) else np.zeros(0, dtype=np.int64)
    missing = ~np.isin(stamps, bag.stamps(topics.TRUTH.name))
    if not missing.any():
        return UnseenThrust(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    measured = bag.arrays(topic, ("applied_force", "mass"))
    acceleration = measured["applied_force"] / measured["mass"][:, None]
    return UnseenThrust(stamps[missing], acceleration[missing])


def truth_of(bag: Bag) -> Fields:
    """True states of the chief and all deputies; raises BagError without truth."""
    return bag.arrays(topics.TRUTH.name, ("chief_state", "deputies"))


def trajectory(bag: Bag, deputy: str, truth: Fields | None = None) -> Trajectory:
    """Trajectory of one deputy; `truth` is `truth_of` the bag, where it has been read already.

    Raises:
        BagError: no truth, or no tick with an estimate and a target of this deputy.
    """
    truth = truth_of(bag) if truth is None else truth
    index = deputies_of(bag).index(deputy)
    missing = [topic.name for topic in (topics.ESTIMATE, topics.TARGET) if topic.of(deputy) not in bag.topics]
    if missing:
        raise BagError(f"{bag.path}: has no {' and no '.join(missing)} of {deputy}")
    estimate = bag.arrays(topics.ESTIMATE.of(deputy), ("relative_state", "covariance", "nis", "innovations"))
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
        innovations=_used_innovations(estimate)[rows[id(estimate)]],
        applied=np.concatenate((applied, unseen.acceleration))[order],
        applied_time=ends[order] * 1e-9 - tick,
        tick=tick,
        period=_period(truth["chief_state"][0]),
    )


def _used_innovations(estimates: Fields) -> Vector:
    """(N,) number of scalar innovations that passed all checks, by estimate."""
    used = np.zeros(len(estimates["time"]))
    for element in estimates.elements("innovations"):
        sizes = [0 if values is None else len(values) for values in estimates[f"{element}.values"]]
        used += np.where(estimates[f"{element}.rejection"] == "", sizes, 0)
    return used


def _period(chief: Vector) -> float:
    """Period (s) of the two-body orbit through an inertial state."""
    radius, speed = float(np.linalg.norm(chief[:3])), float(np.linalg.norm(chief[3:]))
    axis = 1.0 / (2.0 / radius - speed**2 / MU)
    return tau * sqrt(axis**3 / MU)


def event_kinds(events: Fields) -> list[str]:
    """Names of the kinds of events, which bags of 0.1.0 have as text.

    Raises:
        BagError: they are neither numbers nor text.
    """
    if events["kind"].dtype.kind == "U":
        return [str(kind) for kind in events["kind"]]
    return [kind_name(kind) for kind in events.integers("kind").tolist()]
