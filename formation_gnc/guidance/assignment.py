"""Assignment of the satellites of a fleet to the slots of a formation whose phase is free."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment, minimize_scalar

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.transfer import delta_v
from formation_gnc.types import Matrix, Vector

PHASES = 72
"""Grid points of the phase, of which the best is refined."""


@dataclass(frozen=True)
class Assignment:
    """Slots of a fleet, in the order of its satellites."""

    slots: tuple[int, ...]
    """Slot of each satellite."""
    phase: float
    """Phase of the formation, rad, in [0, 2 pi)."""
    delta_v: tuple[float, ...]
    """Predicted delta-v of each satellite, m/s."""


def assign(costs: Matrix, weights: Vector | None = None) -> tuple[int, ...]:
    """Slot of each satellite for the least (weighted) sum of costs.

    Args:
        costs: (satellites, slots) cost of each satellite to each slot.
        weights: (satellites,) weight of each satellite's costs; equal by default.

    Raises:
        ConfigurationError: fewer slots than satellites, or a cost or weight that is not finite or negative.
    """
    count, slots = costs.shape
    if slots < count:
        raise ConfigurationError(f"{slots} slots for {count} satellites: there must be one for each")
    weighted = costs if weights is None else np.asarray(weights)[:, None] * costs
    if not (np.isfinite(weighted).all() and (weighted >= 0.0).all()):
        raise ConfigurationError("costs and weights of an assignment must be finite and not negative")
    return tuple(int(slot) for slot in linear_sum_assignment(weighted)[1])


def fuel_weights(tanks: Vector) -> Vector:
    """(N,) weights in inverse proportion to the propellant left (Kremmydas 3.4), of mean one.

    Args:
        tanks: (N,) propellant left, kg.

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
    """Predicted delta-v (m/s) of each satellite to each slot, (satellites, slots), as a function of the phase (rad).

    Args:
        states: (satellites, 6) relative states now, Hill frame, m and m/s.
        targets: gives the (slots, 6) target states now at a phase, rad.
        duration: of the transfer, s.
        mean_motion: of the chief, rad/s.
    """

    def costs(phase: float) -> Matrix:
        return delta_v(states[:, None, :] - targets(phase)[None], duration, mean_motion)

    return costs


def assign_with_phase(costs: Callable[[float], Matrix], weights: Vector | None = None) -> Assignment:
    """Slots and phase for the least (weighted) sum of costs (Kremmydas 3.4).

    The assignment is solved at each of `PHASES` phases. About the best, the phase is refined for that
    assignment, whose sum is smooth. A minimum narrower than 5 degrees may be missed.

    Args:
        costs: gives the (satellites, slots) costs at a phase, rad, with period 2 pi.
        weights: as of `assign`.

    Raises:
        ConfigurationError: as `assign`.
    """

    def spent(phase: float, slots: tuple[int, ...]) -> Vector:
        return costs(phase)[np.arange(len(slots)), list(slots)]

    def total(phase: float, slots: tuple[int, ...]) -> float:
        each = spent(phase, slots)
        return float(each.sum() if weights is None else np.asarray(weights) @ each)

    step = math.tau / PHASES
    candidates = [(step * k, assign(costs(step * k), weights)) for k in range(PHASES)]
    phase, slots = min(candidates, key=lambda candidate: total(*candidate))
    refined = minimize_scalar(
        total, bounds=(phase - step, phase + step), args=(slots,), method="bounded", options={"xatol": 1e-6}
    )
    if refined.fun < total(phase, slots):
        phase = float(refined.x)
    return Assignment(slots, phase % math.tau, tuple(spent(phase, slots).tolist()))
