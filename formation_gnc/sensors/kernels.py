"""Measurement functions of several sensors at once, compiled."""

import inspect
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numba import int64
from numba.types import Array as NumbaArray
from numpy.typing import NDArray

from formation_gnc.orbit.jit import ANY_VECTOR, inline, kernel
from formation_gnc.sensors.registry import sensors
from formation_gnc.sensors.sensor import Sensor
from formation_gnc.types import Matrix, Vector

CODES = {name: code for code, name in enumerate(sensors())}
"""Number of each sensor inside kernels; it means nothing outside a process."""

CODE_ARRAY = NumbaArray(int64, 1, "A", readonly=True)
"""Numba type of an array of codes."""


def _cache_key() -> str:
    """Digest of the registry: its names in order, and the files of its sensors."""
    digest = sha256()
    for sensor in sensors().values():
        digest.update(sensor.name.encode())
        digest.update(Path(inspect.getfile(sensor.measure)).read_bytes())
    return digest.hexdigest()


CACHE_KEY = _cache_key()
"""For kernels that measure: registered sensors may come from outside the package."""

_SIZES = np.array([sensor.size for sensor in sensors().values()])


@inline
def _measure_none(code: int, deputy: Vector, chief: Vector, row: int, values: Vector, jacobian: Matrix) -> int:
    return row


def _chain(code: int, sensor: Sensor, others: Callable[..., int]) -> Callable[..., int]:
    """Compiled function that measures with this sensor if its code is asked for, else with one of the others."""
    own_code, size = code, sensor.size
    measure, differentiate = inline(sensor.measure), inline(sensor.differentiate)

    @inline
    def measure_one(code: int, deputy: Vector, chief: Vector, row: int, values: Vector, jacobian: Matrix) -> int:
        if code != own_code:
            return others(code, deputy, chief, row, values, jacobian)
        reading = measure(deputy, chief)
        for i in range(size):
            values[row + i] = reading[i]
        differentiate(deputy, chief, jacobian[row : row + size])
        return row + size

    compiled: Callable[..., int] = measure_one
    return compiled


_measure_one: Any = _measure_none
for _code, _sensor in reversed(list(enumerate(sensors().values()))):
    _measure_one = _chain(_code, _sensor, _measure_one)


@inline
def measure_all(codes: NDArray[np.int64], deputy: Vector, chief: Vector) -> tuple[Vector, Matrix]:
    """`measure` for use inside kernels."""
    size = 0
    for code in codes:
        size += _SIZES[code]
    values, jacobian = np.empty(size), np.zeros((size, 6))
    row = 0
    for code in codes:
        row = _measure_one(code, deputy, chief, row, values, jacobian)
    return values, jacobian


@kernel((CODE_ARRAY, ANY_VECTOR, ANY_VECTOR), CACHE_KEY)
def measure(codes: NDArray[np.int64], deputy: Vector, chief: Vector) -> tuple[Vector, Matrix]:
    """Readings without noise and their Jacobian.

    Args:
        codes: of the sensors that read, (k,), values of `CODES`.
        deputy: inertial state, (6,), m and m/s.
        chief: the same of the chief.

    Returns:
        The m values of all readings, one reading after the other, (m,), in the unit of their sensor, and their
        derivatives with respect to the deputy's inertial state, (m, 6), not finite where a sensor has no direction.
    """
    return measure_all(codes, deputy, chief)
