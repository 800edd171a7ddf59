"""Figures of merit of a navigation filter in a recorded run: errors against truth, and its consistency."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from formation_gnc.analysis.trajectory import deputies_of, has_messages
from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.recording.fields import Fields
from formation_gnc.recording.reader import Bag
from formation_gnc.types import Matrix, Vector

Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class EstimateHistory:
    """Estimates of a filter over a run."""

    stamps: Stamps
    """(N,) ns, increasing."""
    state: Matrix
    """(N, 6) relative states, Hill frame, m and m/s."""
    covariance: Matrix
    """(N, 6, 6)."""
    nis: Vector
    """(N,) normalised innovation squared."""
    readings: NDArray[np.int64]
    """(N,) number of readings used."""
    rejections: dict[str, int]
    """Number of rejections by reason, at the end of the run."""


@dataclass(frozen=True)
class NavigationFigures:
    """Figures of a filter; `formation-gnc navigate --json` prints these names."""

    estimates: int
    """Number of estimates in the run."""
    position_rms_m: float
    position_axes_rms_m: list[float]
    velocity_rms_m_s: float
    final_position_m: float
    within_3_sigma: float
    """Share of all components of all errors that are within three standard deviations."""
    mean_nees: float
    """Mean normalised estimation error squared; 6 for a consistent filter."""
    mean_nis: float
    """Mean normalised innovation squared over the ticks with readings."""
    readings: int
    """Number of readings used."""
    rejections: dict[str, int]
    """Number of rejections by reason."""


def navigation_figures(bag: Bag, deputy: str, stamps: Stamps | None = None) -> NavigationFigures:
    """Figures of a deputy's filter in a recorded run.

    Args:
        bag: of the run.
        deputy: its name.
        stamps: (N,) ns, ticks to compare estimate and truth at; None for all that have both.

    Raises:
        BagError: no truth or estimates of the deputy, or none at the given ticks.
    """
    estimates, (truth_stamps, truth) = estimate_history(bag, deputy), _truth(bag, deputy)
    common = np.intersect1d(estimates.stamps, truth_stamps)
    if stamps is not None:
        common = np.intersect1d(common, stamps)
    if not len(common):
        raise BagError(f"{bag.path}: no tick with a truth and an estimate of {deputy}")
    return figures_of_estimates(estimates, common, truth[np.searchsorted(truth_stamps, common)])


def common_stamps(first: Bag, second: Bag, deputy: str) -> Stamps:
    """Stamps (ns) at which both bags have an estimate of a deputy.

    Raises:
        BagError: one bag has no estimates of the deputy, or there is no such stamp.
    """
    ours, theirs = (_arrays(bag, deputy)["stamp_ns"] for bag in (first, second))
    stamps: Stamps = np.intersect1d(ours, theirs)
    if not len(stamps):
        raise BagError(f"no tick with an estimate of {deputy} in both {first.path} and {second.path}")
    return stamps


def estimate_history(bag: Bag, deputy: str) -> EstimateHistory:
    """Estimates of a deputy in a bag.

    Raises:
        BagError: it has none.
    """
    estimates = _arrays(bag, deputy)
    used = np.zeros(len(estimates["time"]), dtype=np.int64)
    for element in estimates.elements("innovations"):
        used += estimates[f"{element}.rejection"] == ""
    return EstimateHistory(
        estimates["stamp_ns"],
        estimates["relative_state"],
        estimates["covariance"].reshape(-1, 6, 6),
        estimates["nis"],
        used,
        _last_rejections(estimates),
    )


def _last_rejections(estimates: Fields) -> dict[str, int]:
    """Number of rejections by reason in the last estimate."""
    last = {element: estimates[f"{element}.reason"][-1] for element in estimates.elements("rejections")}
    return {str(last[each]): int(estimates[f"{each}.count"][-1]) for each in last if last[each] is not None}


def figures_of_estimates(estimates: EstimateHistory, stamps: Stamps, truth: Matrix) -> NavigationFigures:
    """Figures of estimates at some of their ticks.

    Args:
        estimates: of the filter.
        stamps: (N,) ns, a subset of those of the estimates.
        truth: (N, 6) true relative states at `stamps`.
    """
    rows = np.searchsorted(estimates.stamps, stamps)
    error = estimates.state[rows] - truth
    covariance = estimates.covariance[rows]
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    readings, nis = estimates.readings[rows], estimates.nis[rows]
    nees = np.einsum("ni,ni->n", error, np.linalg.solve(covariance, error[..., None])[..., 0])
    return NavigationFigures(
        estimates=len(estimates.stamps),
        position_rms_m=float(np.sqrt(np.mean(np.sum(error[:, :3] ** 2, axis=1)))),
        position_axes_rms_m=np.sqrt(np.mean(error[:, :3] ** 2, axis=0)).tolist(),
        velocity_rms_m_s=float(np.sqrt(np.mean(np.sum(error[:, 3:] ** 2, axis=1)))),
        final_position_m=float(np.linalg.norm(error[-1, :3])),
        within_3_sigma=float(np.mean(np.abs(error) <= 3.0 * sigma)),
        mean_nees=float(nees.mean()),
        mean_nis=float(nis[readings > 0].mean()) if readings.any() else 0.0,
        readings=int(readings.sum()),
        rejections=estimates.rejections,
    )


def _arrays(bag: Bag, deputy: str) -> Fields:
    topic = topics.ESTIMATE.of(deputy)
    if not has_messages(bag, topic):
        raise BagError(f"{bag.path}: has no estimate of {deputy}")
    return bag.arrays(topic, ("relative_state", "covariance", "nis", "innovations", "rejections"))


def _truth(bag: Bag, deputy: str) -> tuple[Stamps, Matrix]:
    """Stamps and relative states of a deputy."""
    names = deputies_of(bag)
    if deputy not in names:
        raise BagError(f"{bag.path}: has no truth of {deputy}; it has {', '.join(names)}")
    truth = bag.arrays(topics.TRUTH.name, ("deputies",))
    return truth["stamp_ns"], truth[f"deputies.{names.index(deputy)}.relative_state"]
