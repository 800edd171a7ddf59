"""Trajectories of a recorded run."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from math import sqrt, tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    commanded_time: Vector
    """(K,) time of each command, s."""
    commanded_delta_v: Vector
    """(K,) delta-v commanded up to the end of that tick, whether or not it was applied, all axes added, m/s."""
    saturated: float
    """Share of the ticks with a demand beyond the thrust limit."""
    fallbacks: int
    """Ticks on which the law's own answer could not be used."""
    law: str
    """Name of the control law of the last command; empty without one."""
    mode: str
    """Last mode; empty without a supervisor."""

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


Columns = tuple[NDArray[Any], ...]
Selection = tuple[Collection[str], Callable[[Fields], Columns]]
"""Fields of a topic, and what is kept of a batch of them."""


def trajectories(bag: Bag) -> dict[str, Trajectory]:
    """Trajectory of each deputy by name, in one pass.

    Raises:
        BagError: no truth, or no tick with an estimate and a target of a deputy.
    """
    names = deputies_of(bag)
    selections: dict[str, Selection] = {topics.TRUTH.name: (("chief_state", "deputies"), _true_columns(len(names)))}
    for name in names:
        missing = [topic.name for topic in (topics.ESTIMATE, topics.TARGET) if topic.of(name) not in bag.topics]
        if missing:
            raise BagError(f"{bag.path}: has no {' and no '.join(missing)} of {name}")
        own = {topic.of(name): selection for topic, selection in OF_DEPUTY.items()}
        selections |= {topic: selection for topic, selection in own.items() if has_messages(bag, topic)}
    columns = _columns(bag, selections)
    stamps, chief, *states = columns[topics.TRUTH.name]
    period = period_of(chief[0])
    return {
        name: assemble(
            f"{bag.path}: {name}",
            {topic: columns[topic.of(name)] for topic in OF_DEPUTY if topic.of(name) in columns},
            (stamps, *states[3 * index : 3 * index + 3]),
            unseen_thrust(bag, name),
            bag.tick_ns * 1e-9,
            period,
        )
        for index, name in enumerate(names)
    }


def _columns(bag: Bag, selections: Mapping[str, Selection]) -> dict[str, Columns]:
    """What is selected of each topic, read in one pass; memory is that of what is kept."""
    parts: dict[str, list[Columns]] = {topic: [] for topic in selections}
    for topic, batch in bag.batches(list(selections), fields={topic: each[0] for topic, each in selections.items()}):
        parts[topic].append(selections[topic][1](batch))
    return {
        topic: tuple(np.concatenate(column) for column in zip(*rows, strict=True))
        for topic, rows in parts.items()
        if rows
    }


def _true_columns(deputies: int) -> Callable[[Fields], Columns]:
    """Stamps and chief's states, then relative state, force applied over the tick before and mass of each deputy."""

    def select(truth: Fields) -> Columns:
        own: Iterator[str] = (f"deputies.{index}.{field}" for index in range(deputies) for field in _OWN_TRUTH)
        return truth["stamp_ns"], truth["chief_state"][:1], *(truth[name] for name in own)

    return select


_OWN_TRUTH = ("relative_state", "applied_force", "mass")


def _estimated_columns(estimates: Fields) -> Columns:
    variance = np.diagonal(estimates["covariance"].reshape(-1, 6, 6), axis1=1, axis2=2)
    used = _used_innovations(estimates)
    return estimates["stamp_ns"], estimates["relative_state"], np.sqrt(variance), estimates["nis"], used


OF_DEPUTY: dict[Any, Selection] = {
    topics.ESTIMATE: (("relative_state", "covariance", "nis", "innovations"), _estimated_columns),
    topics.TARGET: (("relative_state",), lambda target: (target["stamp_ns"], target["relative_state"])),
    topics.THRUST: (("force",), lambda thrust: (thrust["time"], np.abs(thrust["force"]).sum(axis=1))),
    topics.STATUS: (
        ("saturated", "fallback", "algorithm"),
        lambda status: (
            np.asarray(status["saturated"].any(axis=1)),
            np.asarray(status["fallback"] != ""),
            status["algorithm"][-1:],
        ),
    ),
    topics.MODE: (("mode",), lambda mode: (mode["mode"][-1:],)),
}
"""What is read of each of a deputy's topics."""

_NO_COLUMNS: Columns = (np.zeros(0),) * 5


def assemble(
    source: str, columns: Mapping[Any, Columns], truth: Columns, unseen: UnseenThrust, tick: float, period: float
) -> Trajectory:
    """Trajectory of one deputy.

    Args:
        source: where it is from, for errors.
        columns: by topic of `OF_DEPUTY`, as selected there.
        truth: stamps, relative states, forces and masses.
        unseen: thrust over the ticks that truth lacks.
        tick: s.
        period: of the chief's orbit, s.

    Raises:
        BagError: no tick with an estimate and a target.
    """
    true_stamps, states, forces, masses = truth
    estimate_stamps, estimates, sigma, nis, innovations = columns.get(topics.ESTIMATE, _NO_COLUMNS)
    target_stamps, targets, *_ = columns.get(topics.TARGET, _NO_COLUMNS)
    stamps = np.intersect1d(np.intersect1d(true_stamps, estimate_stamps), target_stamps)
    if not len(stamps):
        raise BagError(f"{source}: no tick with an estimate and a target")
    true_rows, rows, target_rows = (
        np.searchsorted(each, stamps) for each in (true_stamps, estimate_stamps, target_stamps)
    )
    ends = np.concatenate((true_stamps[1:], unseen.stamps))
    order = np.argsort(ends, kind="stable")
    applied = (forces / masses[:, None])[1:]  # truth holds the force of the tick before
    commanded_time, commanded, *_ = columns.get(topics.THRUST, _NO_COLUMNS)
    commanded = commanded / np.interp(commanded_time, true_stamps * 1e-9, masses)
    saturated, fallbacks, laws, *_ = columns.get(topics.STATUS, _NO_COLUMNS)
    modes, *_ = columns.get(topics.MODE, _NO_COLUMNS)
    return Trajectory(
        time=stamps * 1e-9,
        truth=states[true_rows],
        estimate=estimates[rows],
        sigma=sigma[rows],
        target=targets[target_rows],
        nis=nis[rows],
        innovations=innovations[rows],
        applied=np.concatenate((applied, unseen.acceleration))[order],
        applied_time=ends[order] * 1e-9 - tick,
        tick=tick,
        period=period,
        commanded_time=commanded_time,
        commanded_delta_v=np.cumsum(commanded) * tick,
        saturated=float(saturated.mean()) if len(saturated) else 0.0,
        fallbacks=int(np.count_nonzero(fallbacks)),
        law=str(laws[-1]) if len(laws) else "",
        mode=str(modes[-1]) if len(modes) else "",
    )


def _used_innovations(estimates: Fields) -> Vector:
    """(N,) number of scalar innovations that passed all checks, by estimate."""
    used = np.zeros(len(estimates["time"]))
    for element in estimates.elements("innovations"):
        sizes = [0 if values is None else len(values) for values in estimates[f"{element}.values"]]
        used += np.where(estimates[f"{element}.rejection"] == "", sizes, 0)
    return used


def period_of(chief: Vector) -> float:
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
