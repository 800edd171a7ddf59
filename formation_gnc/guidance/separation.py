"""Predicted separations in a fleet."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from formation_gnc.errors import OrbitError
from formation_gnc.guidance.targets import TargetPath
from formation_gnc.records import Separation, Target
from formation_gnc.relative.relative_elements import (
    least_separation,
    mean_relative_elements,
    near_circular_elements,
)
from formation_gnc.types import NANOSECONDS, Matrix, Vector

POINTS = 60
"""Points of a revolution at which distances are computed. Straight paths between them leave out a thousandth
of the distance."""


class SeparationMonitor:
    """When to predict separations, and whether the latest prediction was below the warning distance."""

    def __init__(self) -> None:
        """With a prediction due at once."""
        self._latest: int | None = None
        self.is_warning = False
        """Whether the latest prediction was below the warning distance."""

    def is_due(self, time: int, interval: float) -> bool:
        """Whether the latest prediction is at least an interval (s) old at a time (ns)."""
        return self._latest is None or time - self._latest >= interval * NANOSECONDS

    def note(self, separation: Separation, warning: float) -> None:
        """Take note of a prediction, given the warning distance (m)."""
        self._latest = separation.time
        self.is_warning = min(separation.planned, separation.passive) < warning


def predict(
    path: TargetPath,
    target: Target,
    state: Vector,
    names: Sequence[str],
    neighbour_paths: Mapping[str, TargetPath],
    horizon: float,
    mean_motion: float,
) -> Separation:
    """Least distance of a satellite to its neighbours: planned, along its preview, and passive, without thrust.

    Planned, the satellite follows its target, a neighbour with a known path follows that, and all others coast.

    Args:
        path: of this satellite's target; satellites coast in its model.
        target: of this satellite, with its preview and the states of the neighbours.
        state: (6,) of this satellite, Hill frame, m and m/s.
        names: of the neighbours, at least one.
        neighbour_paths: target paths of neighbours by name, as far as they are known.
        horizon: of the passive separation, revolutions.
        mean_motion: of the chief, rad/s.
    """
    time = target.time / NANOSECONDS
    ahead = target.preview_step / NANOSECONDS * np.arange(len(target.preview) + 1.0)
    neighbours = path.coast(target.neighbours, time, ahead)
    for index, name in enumerate(names):
        if name in neighbour_paths:
            neighbours[:, index] = neighbour_paths[name].states(time + ahead)
    planned = np.vstack([target.relative_state, target.preview])[:, None] - neighbours
    later: Vector = np.linspace(0.0, horizon * math.tau / mean_motion, math.ceil(horizon * POINTS) + 1)
    passive = path.coast(state[None], time, later) - path.coast(target.neighbours, time, later)
    near, far = _nearest(planned, ahead), _nearest(passive, later)
    return Separation(
        target.time,
        planned=near[0],
        planned_time=target.time + round(near[1] * NANOSECONDS),
        planned_neighbour=names[near[2]],
        passive=far[0],
        passive_time=target.time + round(far[1] * NANOSECONDS),
        passive_neighbour=names[far[2]],
    )


def least_from_track(state: Vector, chief: Vector, mean_motion: float) -> float:
    """Least distance (m) from the chief's track, across the flight direction, in free motion near a circular chief.

    Args:
        state: (6,) relative, Hill frame, m and m/s.
        chief: inertial state (6,), m and m/s, for mean elements; without an orbit or a node, Hill's equations count.
        mean_motion: of the chief, rad/s.
    """
    try:
        return least_separation(mean_relative_elements(chief, state))
    except OrbitError:
        return least_separation(near_circular_elements(0.0, mean_motion, state))


def describe(separation: Separation) -> str:
    """A separation as the text of an event."""
    return (
        f"planned {separation.planned:.1f} m from {separation.planned_neighbour} at "
        f"{separation.planned_time / NANOSECONDS:.0f} s, "
        f"passive {separation.passive:.1f} m from {separation.passive_neighbour} at "
        f"{separation.passive_time / NANOSECONDS:.0f} s"
    )


def _nearest(offsets: Matrix, times: Vector) -> tuple[float, float, int]:
    """Least distance (m), its time (s) and the index of the neighbour.

    Args:
        offsets: (K, N, 6) states relative to N neighbours.
        times: (K,) s, of the offsets; between them motion is straight.
    """
    position, velocity = offsets[..., :3], offsets[..., 3:]
    half = 0.5 * np.gradient(times)[:, None] if len(times) > 1 else np.zeros((1, 1))
    speed = np.maximum((velocity**2).sum(axis=-1), 1e-300)
    later = np.clip(-(position * velocity).sum(axis=-1) / speed, -half, half)
    later[0], later[-1] = np.maximum(later[0], 0.0), np.minimum(later[-1], 0.0)
    distances = np.linalg.norm(position + later[..., None] * velocity, axis=-1)
    index, who = np.unravel_index(distances.argmin(), distances.shape)
    return float(distances[index, who]), float(times[index] + later[index, who]), int(who)
