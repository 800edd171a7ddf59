"""Measurement model: the readings of a tick, stacked, and what they are expected to be."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray

from formation_gnc.navigation.kernels import motion
from formation_gnc.navigation.kernels.measurement import measure_relative
from formation_gnc.navigation.process import substeps
from formation_gnc.navigation.state_history import StateHistory
from formation_gnc.orbit.frames import hill_transform_inverse, inertial_from_relative
from formation_gnc.sensors.kernels import CODES, measure
from formation_gnc.sensors.registry import sensors
from formation_gnc.types import Matrix, Vector

_NO_ACCELERATION = np.zeros(3)


@dataclass(frozen=True, slots=True)
class MeasurementModel:
    """Stacked measurement function of k readings with m values in all."""

    sensors: tuple[str, ...]
    """Sensor of each reading."""
    codes: NDArray[np.int64]
    """(k,) the same as kernels have it."""
    rows: tuple[slice, ...]
    """Places of each reading's values."""
    angles: NDArray[np.bool_] | None
    """(m,) whether each value is an angle; none when no value is."""
    size: int
    """Number of values, m."""


@lru_cache(maxsize=256)
def measurement_model(names: tuple[str, ...]) -> MeasurementModel:
    """Model of readings by these sensors, in this order; one or more."""
    known = [sensors()[name] for name in names]
    ends = accumulate((sensor.size for sensor in known), initial=0)
    angles = np.array([place in sensor.angles for sensor in known for place in range(sensor.size)])
    return MeasurementModel(
        names,
        np.array([CODES[name] for name in names], dtype=np.int64),
        tuple(slice(begin, end) for begin, end in pairwise(ends)),
        angles if angles.any() else None,
        len(angles),
    )


@dataclass(slots=True)
class Readings:
    """Readings of a tick."""

    model: MeasurementModel
    values: Vector
    """(m,) in the unit of each sensor."""
    ages: Sequence[float]
    """(k,) s."""
    variance: Vector
    """(m,) of the noise."""
    chief: Vector
    """(6,) chief's inertial state now."""
    history: StateHistory
    late: bool
    """Whether any reading is older than now."""

    def expected(self, state: Vector) -> tuple[Vector, Matrix]:
        """Values without noise, (m,), at a relative state now (6,), and their Jacobian (m, 6) with respect to it."""
        model = self.model
        if not self.late:
            now: tuple[Vector, Matrix] = measure_relative(model.codes, self.chief, state)
            return now
        deputy = inertial_from_relative(self.chief, state)
        to_inertial = hill_transform_inverse(self.chief)
        values, jacobian = np.empty(model.size), np.empty((model.size, 6))
        for place, (age, rows) in enumerate(zip(self.ages, model.rows, strict=True)):
            then, transition = self.history.state_before(deputy, age)
            chief = motion.coast(self.chief, _NO_ACCELERATION, -age, substeps(age)) if age else self.chief
            values[rows], derivatives = measure(model.codes[place : place + 1], then, chief)
            jacobian[rows] = [row @ transition @ to_inertial for row in derivatives]
        return values, jacobian

    def innovation(self, expected: Vector) -> Vector:
        """Values minus expected ones (..., m), angles within half a turn."""
        difference: Vector = self.values - expected
        if self.model.angles is not None:
            angles = self.model.angles
            difference[..., angles] = (difference[..., angles] + pi) % (2.0 * pi) - pi
        return difference

    def select(self, chosen: Sequence[bool]) -> "Readings":
        """Readings for which `chosen` (k,) holds; one or more."""
        model = self.model
        pairs = list(zip(model.sensors, model.rows, self.ages, chosen, strict=True))
        values = np.concatenate([np.arange(rows.start, rows.stop) for _, rows, _, each in pairs if each])
        return Readings(
            measurement_model(tuple(name for name, _, _, each in pairs if each)),
            self.values[values],
            [age for _, _, age, each in pairs if each],
            self.variance[values],
            self.chief,
            self.history,
            self.late,
        )
