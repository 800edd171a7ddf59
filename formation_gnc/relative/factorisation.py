"""State-dependent factorisations f(x) = A(x) x of the nonlinear equations of relative motion.

Joshi's SDC1 and SDC2, for the state-dependent Riccati equation, and the factorisation of differential J2. Exact to
rounding error at every state, that of the chief included: the source's truncated series are in closed form here.
All take states (..., 6) with one state of the chief, or one each.
"""

import numpy as np

from formation_gnc.orbit.constants import EARTH_RADIUS, J2
from formation_gnc.relative.chief import ChiefState, frame_matrix
from formation_gnc.relative.model import Array


def sdc1(state: Array, chief: ChiefState) -> Array:
    """(..., 6, 6) factorisation about an eccentric chief: Joshi (5.17)-(5.26), corrected.

    The rotation of the frame includes the tilt of the chief's orbit plane under J2.
    """
    state = np.asarray(state)
    radius = np.asarray(chief.radius)
    gradient, ratio = _growth(state, radius)
    matrix = np.broadcast_to(frame_matrix(chief), (*state.shape, 6)).copy()
    attraction = (chief.mu / (radius * ratio) ** 3)[..., None]
    matrix[..., [3, 4, 5], [0, 1, 2]] -= attraction
    # mu / r^2 - mu r / d^3 = -(mu / r^2) (s^-3 - 1), with s = d / r
    matrix[..., 3, :3] -= chief.mu / radius[..., None] ** 2 * _power_difference(ratio, 3) * gradient
    return matrix


def sdc2(state: Array, chief: ChiefState) -> Array:
    """(..., 6, 6) factorisation about a circular chief: Joshi (5.28)-(5.32).

    With the angular rate for the mean motion, as there: an approximation for an eccentric chief. The printed
    sigma_x = (r / x + 1) sigma_y has no limit at x = 0 off the x axis; its numerator is distributed over the
    columns of x, y and z instead, for the same f(x).
    """
    state = np.asarray(state)
    rate, radius = np.asarray(chief.angular_rate), np.asarray(chief.radius)
    gradient, ratio = _growth(state, radius)
    sigma_z = ratio**-3
    sigma_y = -_power_difference(ratio, 3) * gradient  # (..., 3): sigma_y = 1 - s^-3 = this times [x, y, z]
    matrix = np.zeros((*state.shape, 6))
    matrix[..., [0, 1, 2], [3, 4, 5]] = 1.0
    matrix[..., 3, :3] = (rate**2 * (radius + state[..., 0]))[..., None] * sigma_y
    matrix[..., 3, 4] = 2.0 * rate
    matrix[..., 4, 3] = -2.0 * rate
    matrix[..., 4, 1] = rate**2 * (1.0 - sigma_z)
    matrix[..., 5, 2] = -(rate**2) * sigma_z
    return matrix


FACTORISATIONS = {"sdc1": sdc1, "sdc2": sdc2}
"""Joshi's methods I and II, by name; without J2."""


def oblateness(state: Array, chief: ChiefState) -> Array:
    """(..., 3, 3) matrix G with G [x, y, z] the J2 acceleration of the deputy minus the chief's, exactly.

    From a = -K { p / d^5 - 5 Z^2 p / d^7 + 2 Z k / d^5 }, K = (3/2) J2 mu Re^2, with p the place in the Hill
    frame, d its length, k the pole and Z = k p, by the product rule for differences: each factor's difference
    is a row vector times [x, y, z].
    """
    state = np.asarray(state)
    pole, r = chief.pole, np.asarray(chief.radius)
    gradient, ratio = _growth(state, r)
    r = r[..., None]
    place = state[..., :3] + r * np.array([1.0, 0.0, 0.0])
    distance = r * ratio[..., None]
    fifth = r**-5 * _power_difference(ratio, 5) * gradient  # d^-5 - r^-5 = this times [x, y, z]
    seventh = r**-7 * _power_difference(ratio, 7) * gradient
    height, height_of_chief = np.sum(place * pole, axis=-1, keepdims=True), r * pole[..., :1]
    square = height**2 * seventh + r**-7 * (height + height_of_chief) * pole  # of Z^2 d^-7
    radial = np.zeros((*state.shape[:-1], 3, 3))
    radial[..., 0, :] = r * (fifth - 5.0 * square)
    polar = 2.0 * pole[..., :, None] * (height * fifth + r**-5 * pole)[..., None, :]
    isotropic = (distance**-5 - 5.0 * height**2 * distance**-7)[..., None] * np.eye(3)
    result: Array = -1.5 * J2 * chief.mu * EARTH_RADIUS**2 * (isotropic + radial + polar)
    return result


def _growth(state: Array, radius: Array) -> tuple[Array, Array]:
    """Row vector c (..., 3) with c [x, y, z] = (d / r)^2 - 1, Joshi's -xi; ratio s = d / r (...,)."""
    gradient = state[..., :3] / radius[..., None] ** 2
    gradient[..., 0] += 2.0 / radius
    ratio = np.sqrt(1.0 + np.sum(gradient * state[..., :3], axis=-1))
    return gradient, ratio


def _power_difference(ratio: Array, power: int) -> Array:
    """(s^-n - 1) / (s^2 - 1) as a column (..., 1), without dividing by zero at s = 1.

    The closed form of Joshi's series: (3/2) psi xi = s^-3 - 1 in (5.25), 2 eta xi = s^-4 - 1 in (5.40).
    """
    total = sum(ratio**exponent for exponent in range(power))
    result: Array = (-total / (ratio**power * (1.0 + ratio)))[..., None]
    return result
