"""Who goes where: the places of a formation shared out over a fleet, with the phase of the formation free.

Pure functions: places and phase are then set by the parameters `slot` and `phase` of each guidance.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment, minimize_scalar

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.transfer import delta_v
from formation_gnc.types import Matrix, Vector

PHASES = 72
"""Phases at which an assignment is tried before the best one is refined."""


@dataclass(frozen=True)
class Assignment:
    """Places of a fleet, in the order of its satellites."""

    slots: tuple[int, ...]
    """The place of each satellite."""
    phase: float
    """Phase of the formation, rad, in [0, 2 pi)."""
    delta_v: tuple[float, ...]
    """What each is predicted to spend, m/s."""


def assign(costs: Matrix, weights: Vector | None = None) -> tuple[int, ...]:
    """Place of each satellite such that the (weighted) sum of costs is least.

    Args:
        costs: (satellites, places) what each would spend to each place.
        weights: (satellites,) what a unit spent by each counts; all alike by default.

    Raises:
        ConfigurationError: fewer places than satellites, or a cost or weight that is not finite or negative.
    """
    count, places = costs.shape
    if places < count:
        raise ConfigurationError(f"{places} places for {count} satellites: there must be one for each")
    weighted = costs if weights is None else np.asarray(weights)[:, None] * costs
    if not (np.isfinite(weighted).all() and (weighted >= 0.0).all()):
        raise ConfigurationError("costs and weights of an assignment must be finite and not negative")
    return tuple(int(place) for place in linear_sum_assignment(weighted)[1])


def fuel_weights(tanks: Vector) -> Vector:
    """(N,) weights that spare who has little: inverse to what is left (Kremmydas 3.4), of mean one.

    Raises:
        ConfigurationError: a tank that is not above zero.
    """
    left = np.asarray(tanks, dtype=np.float64)
    if not (np.isfinite(left).all() and (left > 0.0).all()):
        raise ConfigurationError(f"tanks: {left.tolist()} is not allowed; each must be above zero and finite")
    weights: Vector = 1.0 / left
    return np.asarray(weights / weights.mean())


def transfer_costs(
    states: Matrix, targets: Callable[[float], Matrix], duration: float, mean_motion: float
) -> Callable[[float], Matrix]:
    """Predicted delta-v of every satellite to every place, as a function of the formation's phase.

    Args:
        states: (satellites, 6) relative states now, Hill frame, m and m/s.
        targets: gives the (places, 6) states now of the places at a phase, rad.
        duration: time for the transfer, s.
        mean_motion: rate of the chief, rad/s.
    """

    def costs(phase: float) -> Matrix:
        return delta_v(states[:, None, :] - targets(phase)[None], duration, mean_motion)

    return costs


def assign_with_phase(costs: Callable[[float], Matrix], weights: Vector | None = None) -> Assignment:
    """Places and phase with the least (weighted) sum of costs (Kremmydas 3.4).

    An assignment is solved at each of `PHASES` phases; between the neighbours of the best, the phase is
    refined for its own assignment, whose sum is smooth. A minimum narrower than 5 degrees may be missed.

    Args:
        costs: gives the (satellites, places) costs at a phase, rad, with period 2 pi.
        weights: as for `assign`.
    """

    def spent(phase: float, slots: tuple[int, ...]) -> Vector:
        return costs(phase)[np.arange(len(slots)), list(slots)]

    def total(phase: float, slots: tuple[int, ...]) -> float:
        each = spent(phase, slots)
        return float(each.sum() if weights is None else np.asarray(weights) @ each)

    step = math.tau / PHASES
    tried = [(step * k, assign(costs(step * k), weights)) for k in range(PHASES)]
    phase, slots = min(tried, key=lambda trial: total(*trial))
    found = minimize_scalar(
        total, bounds=(phase - step, phase + step), args=(slots,), method="bounded", options={"xatol": 1e-6}
    )
    if found.fun < total(phase, slots):
        phase = float(found.x)
    return Assignment(slots, phase % math.tau, tuple(spent(phase, slots).tolist()))
