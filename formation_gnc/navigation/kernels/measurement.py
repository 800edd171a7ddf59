"""Measurement functions of the relative state."""

import numpy as np
from numpy.typing import NDArray

from formation_gnc.navigation.kernels.linear_algebra import product
from formation_gnc.navigation.kernels.motion import hill_transform_inverse
from formation_gnc.orbit.frames import hill_frame, to_inertial
from formation_gnc.orbit.jit import ANY_VECTOR, kernel
from formation_gnc.sensors.kernels import CACHE_KEY, CODE_ARRAY, measure_all
from formation_gnc.types import Matrix, Vector


@kernel((CODE_ARRAY, ANY_VECTOR, ANY_VECTOR), CACHE_KEY)
def measure_relative(codes: NDArray[np.int64], chief: Vector, state: Vector) -> tuple[Vector, Matrix]:
    """`formation_gnc.sensors.kernels.measure` of, and derivatives with respect to, the relative state (6,)."""
    axes, rate = hill_frame(chief)
    values, jacobian = measure_all(codes, to_inertial(axes, rate, chief, state), chief)
    return values, product(jacobian, hill_transform_inverse(axes, rate))
