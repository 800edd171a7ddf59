"""A recorded run's measurements through a filter, without the graph: the same again, or a changed one
beside it."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from json import loads
from typing import Any

import numpy as np

from formation_gnc.analysis.metrics import deputies_of
from formation_gnc.errors import ConfigurationError
from formation_gnc.navigation.navigation_filter import NavigationFilter, NavigationParameters
from formation_gnc.parameters import leaves, load
from formation_gnc.recording.provenance import parameters_record
from formation_gnc.recording.reader import Bag
from formation_gnc.records import Estimate, EventKind, Measurement, Rejection
from formation_gnc.types import NANOSECONDS, Matrix, Vector


@dataclass(frozen=True)
class Estimates:
    """A filter's answers over a run, N of them."""

    time: np.ndarray
    """(N,) stamps, ns."""
    state: Matrix
    """(N, 6)."""
    covariance: Matrix
    """(N, 6, 6)."""
    nis: Vector
    used: Vector
    """(N,) readings used at each stamp."""
    status: np.ndarray
    rejections: np.ndarray
    """(12,) at the end, by `Rejection`."""


@dataclass(frozen=True)
class FilterFigures:
    """How well a filter did over a run."""

    estimates: int
    position_rms_m: float
    position_axes_rms_m: list[float]
    velocity_rms_m_s: float
    final_position_m: float
    within_3_sigma: float
    """Share of the six errors, over all ticks, that are within three standard deviations."""
    mean_nees: float
    mean_nis: float
    readings: int
    rejections: dict[str, int]


@dataclass(frozen=True)
class Comparison:
    """The recorded filter and the one that was run now, on the ticks that both answered."""

    deputy: str
    recorded: FilterFigures
    now: FilterFigures
    identical: bool
    """Whether every estimate is the recorded one, bit for bit."""


def compare(bag: Bag, deputy: str, overrides: Mapping[str, Any]) -> Comparison:
    """Run a deputy's filter on a bag's measurements, with some parameters changed.

    Raises:
        ConfigurationError: the bag lacks what is needed, or a parameter that is not allowed.
    """
    node = f"/{deputy}/navigation"
    for topic in ("measurement", "estimate"):
        if f"/{deputy}/{topic}" not in bag.topics:
            raise ConfigurationError(f"{bag.path}: has no {topic} of {deputy}")
    parameters = recorded_parameters(bag, node, overrides)
    truth = bag.arrays("/truth")
    index = deputies_of(bag).index(deputy)
    states = truth[f"deputies.{index}.relative_state"]
    before = recorded_estimates(bag, deputy)
    after = stacked(list(fly_again(bag, deputy, NavigationFilter(node, parameters), frozenset(overrides))))
    both = np.intersect1d(np.intersect1d(before.time, after.time), truth["stamp_ns"])
    if not len(both):
        raise ConfigurationError(f"{bag.path}: no tick on which the filters of {deputy} both answered")
    true = states[np.searchsorted(truth["stamp_ns"], both)]
    identical = all(
        np.array_equal(getattr(before, name), getattr(after, name)) for name in Estimates.__dataclass_fields__
    )
    return Comparison(deputy, _figures(before, both, true), _figures(after, both, true), identical)


def recorded_parameters(bag: Bag, node: str, overrides: Mapping[str, Any]) -> NavigationParameters:
    """What the node flew with at its start, with overrides on top."""
    key = parameters_record(node)
    if key not in bag.metadata:
        raise ConfigurationError(f"{bag.path}: has no parameters of {node}")
    values = {name: loads(value) for name, value in bag.metadata[key].items()}
    # A node has parameters of ROS beside its own; an empty list is the default.
    known = {leaf.name for leaf in leaves(NavigationParameters, values)}
    own = {name: value for name, value in values.items() if name in known and value is not None}
    return load(NavigationParameters, own | dict(overrides))


def fly_again(bag: Bag, deputy: str, navigator: NavigationFilter, fixed: frozenset[str]) -> Iterator[Estimate]:
    """Estimates of a filter given the recorded measurements, and the changes of parameters that were made
    in flight.

    Args:
        bag: with the measurements.
        deputy: whose.
        navigator: a fresh one.
        fixed: parameters that keep their value, whatever was changed in flight.
    """
    changes = _changes_in_flight(bag, navigator.name, fixed)
    for _, message, _ in bag.decoded([f"/{deputy}/measurement"]):
        measurement = _measurement(message)
        for each in changes.pop(measurement.time, []):
            navigator.commit(navigator.stage(each))
        estimate = navigator.on_tick(measurement)
        if estimate is not None:
            yield estimate


def _changes_in_flight(bag: Bag, node: str, fixed: frozenset[str]) -> dict[int, list[dict[str, Any]]]:
    """Changes by the stamp at which they took effect; scheduled ones too, which change nothing a second
    time."""
    changes: dict[int, list[dict[str, Any]]] = {}
    if "/events" not in bag.topics:
        return changes
    for _, event, _ in bag.decoded(["/events"]):
        if event.node == node and event.kind == EventKind.PARAMETERS:
            found = {each.name: loads(each.new_value) for each in event.changes if each.name not in fixed}
            if found:
                changes.setdefault(_stamp(event), []).append(found)
    return changes


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec) * NANOSECONDS + int(message.header.stamp.nanosec)


def _measurement(message: Any) -> Measurement:
    return Measurement(
        time=_stamp(message),
        chief_state=message.chief_state,
        sensor=message.sensor.tolist(),
        reading=message.reading.tolist(),
        age=message.age.tolist(),
        applied_force=message.applied_force,
        mass=float(message.mass),
        eclipse=bool(message.eclipse),
        fix_available=bool(message.fix_available),
        fix=message.fix,
        deputy=getattr(message, "deputy", ""),
    )


def recorded_estimates(bag: Bag, deputy: str) -> Estimates:
    """The estimates in a bag."""
    recorded = bag.arrays(f"/{deputy}/estimate")
    rejections = recorded.get("rejections", np.zeros((1, len(Rejection)), dtype=np.uint32))
    return Estimates(
        recorded["stamp_ns"],
        recorded["relative_state"],
        recorded["covariance"].reshape(-1, 6, 6),
        recorded["nis"],
        np.array([len(each) for each in recorded["sensor"]]),
        recorded["status"].astype(int),
        rejections[-1].astype(int),
    )


def stacked(estimates: list[Estimate]) -> Estimates:
    """Estimates as arrays."""
    return Estimates(
        np.array([each.time for each in estimates], dtype=np.int64),
        np.array([each.relative_state for each in estimates]).reshape(-1, 6),
        np.array([each.covariance for each in estimates]).reshape(-1, 6, 6),
        np.array([each.nis for each in estimates]),
        np.array([len(each.sensor) for each in estimates]),
        np.array([each.status for each in estimates]),
        (estimates[-1].rejections if estimates else np.zeros(len(Rejection))).astype(int),
    )


def _figures(estimates: Estimates, times: np.ndarray, truth: Matrix) -> FilterFigures:
    rows = np.searchsorted(estimates.time, times)
    error = estimates.state[rows] - truth
    covariance = estimates.covariance[rows]
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    used, nis = estimates.used[rows], estimates.nis[rows]
    squared = np.einsum("ni,ni->n", error, np.linalg.solve(covariance, error[..., None])[..., 0])
    return FilterFigures(
        estimates=len(estimates.time),
        position_rms_m=float(np.sqrt(np.mean(np.sum(error[:, :3] ** 2, axis=1)))),
        position_axes_rms_m=np.sqrt(np.mean(error[:, :3] ** 2, axis=0)).tolist(),
        velocity_rms_m_s=float(np.sqrt(np.mean(np.sum(error[:, 3:] ** 2, axis=1)))),
        final_position_m=float(np.linalg.norm(error[-1, :3])),
        within_3_sigma=float(np.mean(np.abs(error) <= 3.0 * sigma)),
        mean_nees=float(squared.mean()),
        mean_nis=float(nis[used > 0].mean()) if used.any() else 0.0,
        readings=int(used.sum()),
        rejections={
            reason.name.lower(): int(n) for reason, n in zip(Rejection, estimates.rejections, strict=True) if n
        },
    )


def as_json(comparison: Comparison) -> dict[str, Any]:
    """For machines."""
    return asdict(comparison)
