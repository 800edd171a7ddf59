"""Osculating and mean elements under J2, to first order, and the secular rates of the mean ones."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.model import Array


@dataclass(frozen=True)
class NodalElements:
    """Elements without singularity for a circular orbit: Joshi's (3.49), with both kinds of latitude.

    An array of them is ordered [a, lambda, i, q1, q2, Omega]: semi-major axis (m), mean argument of latitude,
    inclination, e cos(omega), e sin(omega), right ascension of the node (rad).
    """

    semi_major_axis: float
    mean_latitude: float
    inclination: float
    q1: float
    q2: float
    right_ascension: float

    @classmethod
    def of(cls, elements: Elements) -> "NodalElements":
        """The same orbit."""
        e, omega = elements.eccentricity, elements.argument_of_perigee
        return cls(
            elements.semi_major_axis,
            elements.mean_anomaly + omega,
            elements.inclination,
            e * math.cos(omega),
            e * math.sin(omega),
            elements.right_ascension,
        )

    @property
    def array(self) -> Array:
        """(6,) the elements in order."""
        return np.array(
            [
                self.semi_major_axis,
                self.mean_latitude,
                self.inclination,
                self.q1,
                self.q2,
                self.right_ascension,
            ]
        )

    @property
    def latitude(self) -> float:
        """True argument of latitude theta, rad, by Kepler's equation lambda = F - q1 sin F + q2 cos F."""
        q1, q2 = self.q1, self.q2
        longitude = self.mean_latitude
        for _ in range(50):
            sine, cosine = math.sin(longitude), math.cos(longitude)
            change = (longitude - q1 * sine + q2 * cosine - self.mean_latitude) / (
                1.0 - q1 * cosine - q2 * sine
            )
            longitude -= change
            if abs(change) < 1e-15:
                break
        sine, cosine = math.sin(longitude), math.cos(longitude)
        beta = 1.0 / (1.0 + math.sqrt(1.0 - q1**2 - q2**2))
        e_sine = q1 * sine - q2 * cosine
        # tan((f - E) / 2) = beta e sin E / (1 - beta e cos E), and theta - F = f - E
        return longitude + 2.0 * math.atan2(beta * e_sine, 1.0 - beta * (q1 * cosine + q2 * sine))

    @property
    def latitude_slopes(self) -> tuple[float, float, float]:
        """Derivatives of theta by lambda, q1 and q2, the other two held."""
        by_mean_latitude, by_q1, by_q2 = _latitude_slopes(self.latitude, self.q1, self.q2)
        return float(by_mean_latitude), float(by_q1), float(by_q2)


def mean_elements(osculating: NodalElements) -> NodalElements:
    """Mean elements, to first order in J2: those without the short-period perturbations."""
    target = osculating.array
    scale = np.array([osculating.semi_major_axis, 1.0, 1.0, 1.0, 1.0, 1.0])
    mean = target
    for _ in range(20):  # each round gains three digits
        following = target - _short_period(NodalElements(*mean))
        settled = np.abs((following - mean) / scale).max() < 1e-15
        mean = following
        if settled:
            break
    return NodalElements(*(float(value) for value in mean))


def osculating_elements(mean: NodalElements) -> NodalElements:
    """Osculating elements of mean ones, to first order in J2."""
    return NodalElements(*(float(value) for value in mean.array + _short_period(mean)))


def secular_rates(mean: NodalElements) -> tuple[float, float, float]:
    """Rates of lambda, of the perigee omega and of the node Omega, rad/s, to first order in J2."""
    eta = math.sqrt(1.0 - mean.q1**2 - mean.q2**2)
    n, s = math.sqrt(MU / mean.semi_major_axis**3), math.sin(mean.inclination) ** 2
    rate = 1.5 * J2 * (EARTH_RADIUS / (mean.semi_major_axis * eta**2)) ** 2 * n
    perigee = rate * (2.0 - 2.5 * s)
    return n + perigee + rate * eta * (1.0 - 1.5 * s), perigee, -rate * math.cos(mean.inclination)


def short_period_jacobian(orbit: NodalElements) -> Array:
    """(6, 6) derivative of the short-period perturbations, by a complex step: exact to rounding."""
    step = 1e-30
    by_mean_latitude, by_q1, by_q2 = orbit.latitude_slopes
    slopes = np.array([0.0, by_mean_latitude - 1.0, 0.0, by_q1, by_q2, 0.0])
    values, centre = orbit.array, orbit.latitude - orbit.mean_latitude
    jacobian = np.empty((6, 6))
    for column in range(6):
        moved = values + 1j * step * (np.arange(6) == column)
        jacobian[:, column] = _perturbations(moved, centre + 1j * step * slopes[column]).imag / step
    return jacobian


def _short_period(orbit: NodalElements) -> Array:
    """(6,) short-period perturbations of the elements."""
    return _perturbations(orbit.array, orbit.latitude - orbit.mean_latitude)


def _perturbations[T: (np.float64, np.complex128)](
    values: NDArray[T] | NDArray[np.float64], centre: complex
) -> NDArray[T]:
    """Poisson brackets of the elements with the generating function W of the short-period terms.

    W = n J2 Re^2 / (2 eta^3) { (3 s/2 - 1) (theta - lambda + e sin f)
        - (3 s/4) [sin 2 theta (1 + (4/3) e cos f) - (2/3) cos 2 theta e sin f] },  s = sin^2 i,

    the integral over the mean anomaly of the J2 potential less its average (docs/theory). `centre` is theta
    minus lambda. Takes complex values, for derivatives.
    """
    axis, mean_latitude, inclination, q1, q2, _ = values
    theta = mean_latitude + centre
    sine, cosine, sine2, cosine2 = np.sin(theta), np.cos(theta), np.sin(2.0 * theta), np.cos(2.0 * theta)
    sin_i, cos_i = np.sin(inclination), np.cos(inclination)
    s = sin_i**2
    eta = np.sqrt(1.0 - q1**2 - q2**2)
    n = np.sqrt(MU / axis**3)
    e_cosine, e_sine = q1 * cosine + q2 * sine, q1 * sine - q2 * cosine
    strength = 0.5 * n * J2 * EARTH_RADIUS**2 / eta**3
    # W / strength, and its derivatives with respect to theta (lambda, q1, q2 held), e sin f and e cos f
    polar = sine2 * (1.0 + 4.0 / 3.0 * e_cosine) - 2.0 / 3.0 * cosine2 * e_sine
    by_e_sine = 1.5 * s - 1.0 + 0.5 * s * cosine2
    by_e_cosine = -s * sine2
    polar_turn = 2.0 * cosine2 * (1.0 + 4.0 / 3.0 * e_cosine) + 4.0 / 3.0 * sine2 * e_sine
    w = (1.5 * s - 1.0) * (centre + e_sine) - 0.75 * s * polar
    by_theta = 1.5 * s - 1.0 - 0.75 * s * polar_turn + by_e_sine * e_cosine - by_e_cosine * e_sine
    theta_by_latitude, theta_by_q1, theta_by_q2 = _latitude_slopes(theta, q1, q2)
    w_latitude = strength * (by_theta * theta_by_latitude - (1.5 * s - 1.0))
    w_q1 = strength * (
        by_theta * theta_by_q1 + by_e_sine * sine + by_e_cosine * cosine + 3.0 * q1 / eta**2 * w
    )
    w_q2 = strength * (
        by_theta * theta_by_q2 - by_e_sine * cosine + by_e_cosine * sine + 3.0 * q2 / eta**2 * w
    )
    w_axis = -1.5 / axis * strength * w
    w_s = strength * (1.5 * (centre + e_sine) - 0.75 * polar)
    w_node = -0.75 * strength * polar_turn  # derivative by the perigee over s, mean anomaly held
    action = n * axis**2
    momentum = action * eta
    tilt = 2.0 * cos_i**2 / momentum * w_s  # cot i / G times dW/di
    ellipse = eta / ((1.0 + eta) * action)
    return np.array(
        [
            -2.0 / (n * axis) * w_latitude,
            2.0 / (n * axis) * w_axis + tilt - ellipse * (q1 * w_q1 + q2 * w_q2),
            -sin_i * cos_i / momentum * w_node,
            ellipse * q1 * w_latitude + eta / action * w_q2 - q2 * tilt,
            ellipse * q2 * w_latitude - eta / action * w_q1 + q1 * tilt,
            -2.0 * cos_i / momentum * w_s,
        ]
    )


def _latitude_slopes(theta: Any, q1: Any, q2: Any) -> tuple[Any, Any, Any]:
    """Derivatives of theta by lambda, q1 and q2; of real or complex numbers."""
    sine, cosine = np.sin(theta), np.cos(theta)
    eta = np.sqrt(1.0 - q1**2 - q2**2)
    e_cosine, e_sine = q1 * cosine + q2 * sine, q1 * sine - q2 * cosine
    kappa = (1.0 + eta + eta**2) / (1.0 + eta)
    by_q1 = (2.0 + e_cosine) * (sine - e_sine * q1 / (1.0 + eta)) + kappa * q2
    by_q2 = -(2.0 + e_cosine) * (cosine + e_sine * q2 / (1.0 + eta)) - kappa * q1
    return (1.0 + e_cosine) ** 2 / eta**3, by_q1 / eta**3, by_q2 / eta**3
