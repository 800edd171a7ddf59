"""How near satellites will come to one another."""

import math
from collections.abc import Mapping

import numpy as np

from formation_gnc.guidance.targets import TargetPath
from formation_gnc.records import Separation, Target
from formation_gnc.types import NANOSECONDS, Matrix, Vector

POINTS = 60
"""Points of a revolution at which distances are looked at; between two, satellites move straight on, which
leaves out a thousandth of the distance."""


def predict(
    path: TargetPath,
    target: Target,
    state: Vector,
    names: list[str],
    neighbours: Mapping[str, TargetPath],
    horizon: float,
    mean_motion: float,
) -> Separation:
    """Least distance of a satellite to the others: along its preview, and if nobody's thrusters fire.

    Along the preview the satellite is on its target; of the others, who has a known path is on it, and the
    rest coast.

    Args:
        path: gives the model in which satellites coast.
        target: where the satellite is to be, with the preview, and where the others are.
        state: (6,) where it is, Hill frame, m and m/s.
        names: of the others, one or more.
        neighbours: paths of others, by name, as far as they are known.
        horizon: revolutions for which all coast.
        mean_motion: rate of the chief, rad/s.
    """
    time = target.time / NANOSECONDS
    ahead = target.preview_step / NANOSECONDS * np.arange(len(target.preview) + 1.0)
    others = path.coast(target.neighbours, time, ahead)
    for index, name in enumerate(names):
        if name in neighbours:
            others[:, index] = neighbours[name].states(time + ahead)
    planned = np.vstack([target.relative_state, target.preview])[:, None] - others
    later: Vector = np.linspace(0.0, horizon * math.tau / mean_motion, math.ceil(horizon * POINTS) + 1)
    passive = path.coast(state - target.neighbours, time, later)
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


def in_words(separation: Separation) -> str:
    """For an event."""
    return (
        f"{separation.planned:.1f} m from {separation.planned_neighbour} at "
        f"{separation.planned_time / NANOSECONDS:.0f} s on target, "
        f"{separation.passive:.1f} m from {separation.passive_neighbour} at "
        f"{separation.passive_time / NANOSECONDS:.0f} s without thrust"
    )


def _nearest(offsets: Matrix, times: Vector) -> tuple[float, float, int]:
    """Least distance (m), when (s) and of whom, given relative states (K, N, 6) at times (K,)."""
    position, velocity = offsets[..., :3], offsets[..., 3:]
    half = 0.5 * np.gradient(times)[:, None] if len(times) > 1 else np.zeros((1, 1))
    speed = np.maximum((velocity**2).sum(axis=-1), 1e-300)
    later = np.clip(-(position * velocity).sum(axis=-1) / speed, -half, half)
    later[0], later[-1] = np.maximum(later[0], 0.0), np.minimum(later[-1], 0.0)
    distances = np.linalg.norm(position + later[..., None] * velocity, axis=-1)
    index, who = np.unravel_index(distances.argmin(), distances.shape)
    return float(distances[index, who]), float(times[index] + later[index, who]), int(who)
