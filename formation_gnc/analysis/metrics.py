"""Figures of merit of a recorded run."""

from dataclasses import asdict, dataclass
from math import sqrt, tau

import numpy as np
from scipy.stats import chi2

from formation_gnc.analysis.verdict import ErrorHistory, Verdict
from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.orbit.constants import MU
from formation_gnc.recording.reader import Bag, Fields
from formation_gnc.records import EventKind
from formation_gnc.types import Matrix, Vector


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


@dataclass(frozen=True)
class DeputyFigures:
    """Figures of one deputy, by the names that `formation-gnc sil --json` prints."""

    verdict: Verdict
    final_error_m: float
    rms_error_m: float
    error_trend: float
    """Largest error of the last orbit over that of the orbit before; halves of the run if it is shorter."""
    estimate_rms_m: float
    mean_nis: float
    nis_ratio: float
    """Sum of the normalised innovations squared over its expectation, the number of innovations."""
    nis_band: list[float]
    """Bounds of `nis_ratio` for a consistent filter, with 99.73 %."""
    divergences: int
    """Number of times the filter diverged or its estimate was lost."""
    delta_v_m_s: float
    delta_v_axes_m_s: list[float]
    commanded_delta_v_m_s: float
    saturated: float
    """Share of the ticks on which the thrust limit cut the demand."""
    fallbacks: int
    """Ticks on which the law's own answer could not be used."""

    def by_name(self) -> dict[str, float | str]:
        """Figures by name, each axis and each bound in words of its own."""
        values = asdict(self)
        for axis, value in zip("xyz", values.pop("delta_v_axes_m_s"), strict=True):
            values[f"delta_v_{axis}_m_s"] = value
        values["nis_band"] = " to ".join(f"{bound:.3f}" for bound in self.nis_band)
        return values


@dataclass(frozen=True)
class RunFigures:
    """Figures of a whole run."""

    ticks: int
    misses: int
    deputies: dict[str, DeputyFigures]

    @property
    def verdict(self) -> Verdict:
        """That of the deputy which is worst off."""
        return max((each.verdict for each in self.deputies.values()), key=list(Verdict).index)


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


def trajectory(bag: Bag, deputy: str) -> Trajectory:
    """Trajectory of one deputy.

    Raises:
        BagError: no truth, or no tick with an estimate and a target of this deputy.
    """
    truth = bag.arrays(topics.TRUTH.name, ("chief_state", "deputies"))
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
    time = truth["time"]
    tick = float(time[1] - time[0]) if len(time) > 1 else 0.0
    covariance = estimate["covariance"][rows[id(estimate)]].reshape(-1, 6, 6)
    return Trajectory(
        time=stamps * 1e-9,
        truth=truth[f"{prefix}relative_state"][rows[id(truth)]],
        estimate=estimate["relative_state"][rows[id(estimate)]],
        sigma=np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)),
        target=target["relative_state"][rows[id(target)]],
        nis=estimate["nis"][rows[id(estimate)]],
        innovations=_used_innovations(estimate)[rows[id(estimate)]],
        # Truth holds the force of the tick before.
        applied=(truth[f"{prefix}applied_force"] / truth[f"{prefix}mass"][:, None])[1:],
        applied_time=time[:-1],
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


def commanded_delta_v(bag: Bag, deputy: str) -> tuple[Vector, Vector]:
    """Delta-v that the controller commanded, whether or not it was applied.

    Returns:
        (N,) time, s, and (N,) delta-v up to the end of that tick, all axes added, m/s.
    """
    topic = topics.THRUST.of(deputy)
    if not has_messages(bag, topic):
        return np.zeros(0), np.zeros(0)
    thrust, truth = bag.arrays(topic, ("force",)), bag.arrays(topics.TRUTH.name, ("deputies",))
    prefix = f"deputies.{deputies_of(bag).index(deputy)}."
    mass = np.interp(thrust["time"], truth["time"], truth[f"{prefix}mass"])
    tick = float(truth["time"][1] - truth["time"][0]) if len(truth["time"]) > 1 else 0.0
    return thrust["time"], np.cumsum(np.abs(thrust["force"]).sum(axis=1) / mass) * tick


def figures(bag: Bag) -> RunFigures:
    """Figures of a run.

    Raises:
        BagError: as for `trajectory`.
    """
    events = bag.arrays(topics.EVENTS.name, ("kind", "node")) if has_messages(bag, topics.EVENTS.name) else None
    deputies = {name: _deputy_figures(bag, name, events) for name in deputies_of(bag)}
    misses = 0 if events is None else int(np.count_nonzero(events.integers("kind") == EventKind.MISS))
    return RunFigures(bag.topics[topics.TRUTH.name].count, misses, deputies)


def _deputy_figures(bag: Bag, name: str, events: Fields | None) -> DeputyFigures:
    path = trajectory(bag, name)
    error = np.linalg.norm(path.error, axis=1)
    estimation = np.linalg.norm(path.estimation_error[:, :3], axis=1)
    measured = path.nis[path.nis > 0.0]
    count = float(path.innovations.sum())
    changes = _times_of(events, name, EventKind.RECONFIGURATION, EventKind.INFEASIBLE)
    size = np.linalg.norm(path.target[:, :3], axis=1)
    history = ErrorHistory(
        path.time,
        error,
        size,
        float(path.applied_time[-1] if len(path.applied_time) else 0.0),
        path.period,
        float(changes[-1]) if len(changes) else 0.0,
    )
    _, commanded = commanded_delta_v(bag, name)
    saturated, fallbacks = _limits_met(bag, name)
    return DeputyFigures(
        verdict=history.verdict,
        final_error_m=float(error[-1]),
        rms_error_m=float(np.sqrt(np.mean(error**2))),
        error_trend=history.trend,
        estimate_rms_m=float(np.sqrt(np.mean(estimation**2))),
        mean_nis=float(measured.mean()) if len(measured) else 0.0,
        nis_ratio=float(path.nis.sum()) / count if count else 0.0,
        nis_band=(chi2.ppf([0.00135, 0.99865], count) / count).tolist() if count else [0.0, 0.0],
        divergences=len(_times_of(events, name, EventKind.DIVERGED, EventKind.LOST)),
        delta_v_m_s=float(path.delta_v.sum()),
        delta_v_axes_m_s=path.delta_v.tolist(),
        commanded_delta_v_m_s=float(commanded[-1]) if len(commanded) else 0.0,
        saturated=saturated,
        fallbacks=fallbacks,
    )


def _times_of(events: Fields | None, deputy: str, *kinds: EventKind) -> Vector:
    """Times (s) of a deputy's events of some kinds."""
    if events is None:
        return np.zeros(0)
    own = np.array([str(node).startswith(f"/{deputy}/") for node in events["node"]])
    return np.asarray(events["time"][own & np.isin(events.integers("kind"), kinds)])


def _limits_met(bag: Bag, deputy: str) -> tuple[float, int]:
    """Share of the ticks with a demand beyond the thrust limit, and number of ticks on a fallback."""
    topic = topics.STATUS.of(deputy)
    if not has_messages(bag, topic):
        return 0.0, 0
    status = bag.arrays(topic, ("saturated", "fallback"))
    return float(status["saturated"].any(axis=1).mean()), int(np.count_nonzero(status["fallback"] != ""))


def law_at_the_end(bag: Bag, deputy: str) -> str:
    """Name of the control law of the last command; empty without one."""
    topic = topics.STATUS.of(deputy)
    return str(bag.arrays(topic, ("algorithm",))["algorithm"][-1]) if has_messages(bag, topic) else ""
