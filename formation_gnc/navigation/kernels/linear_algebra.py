"""Covariances, Gramians and products of small matrices."""

from math import sqrt

import numpy as np
from numba import float64

from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, inline, kernel
from formation_gnc.types import Matrix, Vector

WRITABLE_VECTOR, WRITABLE_MATRIX = float64[::1], float64[:, ::1]
"""Numba types of arrays that a kernel writes into."""

_LEAST_PIVOT = 1e-13
"""Pivot in the Cholesky factorisation of a correlation matrix below which it may be rounding alone."""


@inline
def product(left: Matrix, right: Matrix) -> Matrix:
    """Matrix product, for use inside kernels."""
    rows, inner, columns = left.shape[0], right.shape[0], right.shape[1]
    out = np.zeros((rows, columns))
    for i in range(rows):
        for k in range(inner):
            factor = left[i, k]
            for j in range(columns):
                out[i, j] += factor * right[k, j]
    return out


@inline
def congruence(matrix: Matrix, covariance: Matrix, noise: Matrix) -> Matrix:
    """M P M' + Q, symmetric to the last bit, for use inside kernels."""
    half = product(matrix, covariance)
    size = matrix.shape[0]
    out = np.empty((size, size))
    for i in range(size):
        for j in range(i + 1):
            total = noise[i, j]
            for k in range(matrix.shape[1]):
                total += half[i, k] * matrix[j, k]
            out[i, j] = out[j, i] = total
    return out


@kernel((ANY_MATRIX, ANY_MATRIX, ANY_MATRIX))
def propagate_covariance(transition: Matrix, covariance: Matrix, noise: Matrix) -> Matrix:
    """F P F' + Q, symmetric to the last bit."""
    return congruence(transition, covariance, noise)


@kernel((WRITABLE_MATRIX, ANY_MATRIX))
def accumulate_transition(total: Matrix, transition: Matrix) -> None:
    """Multiply a transition matrix (6, 6) by the next one from the left."""
    total[:] = product(transition, total)


@kernel((WRITABLE_MATRIX, ANY_MATRIX, ANY_MATRIX, ANY_VECTOR))
def accumulate_information(gramian: Matrix, jacobian: Matrix, transition: Matrix, variance: Vector) -> None:
    """Add (H Phi)' R^-1 (H Phi) to a Gramian (6, 6): H (m, 6), variances (m,)."""
    rows = product(jacobian, transition)
    for i in range(6):
        for j in range(i + 1):
            total = gramian[i, j]
            for row in range(rows.shape[0]):
                total += rows[row, i] * rows[row, j] / variance[row]
            gramian[i, j] = gramian[j, i] = total


@kernel((ANY_MATRIX, ANY_MATRIX, ANY_VECTOR))
def innovation_variances(jacobian: Matrix, covariance: Matrix, noise: Vector) -> Vector:
    """Variance of each innovation, (m,): diagonal of H P H' with H (m, 6), plus the noise (m,)."""
    half = product(jacobian, covariance)
    out = noise.copy()
    for row in range(jacobian.shape[0]):
        for k in range(jacobian.shape[1]):
            out[row] += half[row, k] * jacobian[row, k]
    return out


@kernel((ANY_VECTOR, ANY_MATRIX))
def are_finite(state: Vector, covariance: Matrix) -> bool:
    """Whether a state (6,) and its covariance (6, 6) are finite."""
    total = 0.0
    for i in range(6):
        total += 0.0 * state[i]
        for j in range(6):
            total += 0.0 * covariance[i, j]
    return total == 0.0


@inline
def _is_definite(covariance: Matrix, scale: Vector) -> bool:
    """Whether the correlations of a covariance with these standard deviations have a Cholesky factorisation."""
    size = covariance.shape[0]
    factor = np.empty((size, size))
    is_definite = True
    for j in range(size):
        for i in range(j, size):
            total = covariance[i, j] / (scale[i] * scale[j])
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j:
                is_definite = is_definite and total > _LEAST_PIVOT
                factor[j, j] = sqrt(max(total, _LEAST_PIVOT))
            else:
                factor[i, j] = total / factor[j, j]
    return is_definite


@kernel((WRITABLE_MATRIX,))
def restore_definiteness(covariance: Matrix) -> None:
    """Symmetrise a covariance; if rounding has taken its definiteness, add to the diagonal until it is back.

    NaN stays NaN.
    """
    size = covariance.shape[0]
    for i in range(size):
        for j in range(i + 1):
            covariance[i, j] = covariance[j, i] = 0.5 * (covariance[i, j] + covariance[j, i])
    least = 1e-30
    for i in range(size):
        least = max(least, 1e-24 * covariance[i, i])
    scale = np.empty(size)
    for i in range(size):
        if covariance[i, i] < least:
            covariance[i, i] = least
        scale[i] = sqrt(covariance[i, i])
    added = 1e-12
    for _ in range(40):
        if _is_definite(covariance, scale):
            return
        for i in range(size):
            covariance[i, i] += added * scale[i] * scale[i]
        added *= 4.0
