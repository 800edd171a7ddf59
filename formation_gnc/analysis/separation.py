"""Distances between satellites."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from formation_gnc.analysis.metrics import deputies_of, has_messages
from formation_gnc.flight import topics
from formation_gnc.recording.decode import nanoseconds
from formation_gnc.recording.reader import Bag
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class Separation:
    """Nearest approach of a fleet."""

    distance: float
    """m."""
    time: float
    """s."""
    pair: tuple[str, str]
    """Names of the two satellites."""


def minimum_separation(times: Vector, positions: Matrix, names: Sequence[str]) -> Separation | None:
    """Nearest approach of any two satellites at given times; None for fewer than two.

    Args:
        times: (N,) s.
        positions: (satellites, N, 3), in one frame, m.
        names: of the satellites.
    """
    nearest: Separation | None = None
    for one, other in combinations(range(len(names)), 2):
        distances = np.linalg.norm(positions[one] - positions[other], axis=1)
        index = int(distances.argmin())
        if nearest is None or distances[index] < nearest.distance:
            nearest = Separation(float(distances[index]), float(times[index]), (names[one], names[other]))
    return nearest


def predicted_approach(bag: Bag, kind: str) -> Separation | None:
    """Nearest approach that guidance predicted in a recorded run; None without predictions.

    Args:
        bag: of the run.
        kind: "planned" or "passive", as in Separation.msg.

    Raises:
        BagError: no truth.
    """
    nearest: Separation | None = None
    for name in deputies_of(bag):
        topic = topics.SEPARATION.of(name)
        if not has_messages(bag, topic):
            continue
        predicted = bag.arrays(topic)
        index = int(predicted[kind].argmin())
        distance = float(predicted[kind][index])
        if nearest is None or distance < nearest.distance:
            time = 1e-9 * float(nanoseconds(predicted, f"{kind}_time")[index])
            nearest = Separation(distance, time, (name, str(predicted[f"{kind}_neighbour"][index])))
    return nearest
