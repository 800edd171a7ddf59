"""Kalman filters over the relative state in the Hill frame; the unscented one by FilterPy."""

from collections.abc import Callable
from functools import cache, lru_cache
from math import isfinite, sqrt
from typing import Any, Protocol

import numpy as np
from scipy.linalg import inv

from formation_gnc.navigation.kernels.linear_algebra import innovation_variances, restore_definiteness
from formation_gnc.navigation.measurement import Readings
from formation_gnc.navigation.process import Interval, ProcessModel
from formation_gnc.navigation.pseudo_measurements import pseudo_jacobian, pseudo_measurements
from formation_gnc.types import Matrix, Vector


@cache
def filterpy() -> Any:
    """FilterPy's filters, imported at the first call: their two seconds are for who flies the unscented one."""
    import filterpy.kalman

    return filterpy.kalman


class RelativeFilter(Protocol):
    """Filter of the relative state; at a tick `predict`, then with readings `linearize`, then `update`."""

    state: Vector
    """(6,) relative state."""
    covariance: Matrix
    """(6, 6) of the state."""

    def predict(self, process: ProcessModel, interval: Interval, noise: Matrix) -> Matrix:
        """Predict to the end of the interval; returns the transition matrix (6, 6)."""

    def linearize(self, readings: Readings) -> tuple[Vector, Vector, Matrix]:
        """Innovations (m,) at the predicted state, the variance of each (m,), and the Jacobian (m, 6)."""

    def update(self, pseudo: bool) -> float:
        """Update with the readings linearised last; returns the NIS.

        pseudo: as Neokleous' pseudo-measurements, with their noise to first order.
        """


class ExtendedFilter:
    """Extended Kalman filter: nonlinear prediction, update in Joseph form."""

    def __init__(self, state: Vector, covariance: Matrix) -> None:
        """Start from a relative state (6,) and its covariance (6, 6)."""
        self.state, self.covariance = state, covariance

    def predict(self, process: ProcessModel, interval: Interval, noise: Matrix) -> Matrix:
        """Predict with the process model, which gives F P F' + Q too."""
        self.state, self.covariance, transition = process.predict(interval, self.state, self.covariance, noise)
        return transition

    def linearize(self, readings: Readings) -> tuple[Vector, Vector, Matrix]:
        """Linearise at the predicted state."""
        expected, jacobian = readings.expected(self.state)
        innovation = readings.innovation(expected)
        self._linearized = readings, innovation, expected, jacobian
        return innovation, innovation_variances(jacobian, self.covariance, readings.variance), jacobian

    def update(self, pseudo: bool) -> float:
        """Update in units of standard deviations: m^2 and rad^2 are too far apart to invert together.

        In the order of operations of FilterPy's `ExtendedKalmanFilter`, with the same bits.
        """
        readings, innovation, expected, jacobian = self._linearized
        variance = readings.variance
        if pseudo:
            model, radius = readings.model, _radius(readings)
            slope = pseudo_jacobian(model, expected)
            innovation = pseudo_measurements(model, expected + innovation, radius) - pseudo_measurements(
                model, expected, radius
            )
            jacobian, noise = slope @ jacobian, slope * variance @ slope.T
            variance = np.diag(noise)
            noise = noise / np.sqrt(np.outer(variance, variance))
        else:
            noise = _identity(len(variance))
        scale = np.sqrt(variance)
        jacobian, residual = jacobian / scale[:, None], innovation / scale
        cross = self.covariance.dot(jacobian.T)
        spread = jacobian.dot(cross) + noise
        if not isfinite(spread.trace()):
            raise ArithmeticError("the update is not finite")
        inverse = inv(spread, check_finite=False)
        gain = cross.dot(inverse)
        kept = _identity(6) - gain.dot(jacobian)
        covariance = kept.dot(self.covariance).dot(kept.T) + gain.dot(noise).dot(gain.T)
        restore_definiteness(covariance)
        self.state, self.covariance = self.state + gain.dot(residual), covariance
        return float(residual @ inverse @ residual)


class UnscentedFilter:
    """Unscented Kalman filter on twelve points of equal weight.

    All weights are positive, so that the predicted covariance stays positive definite; all points are a standard
    deviation or more away, so that they survive the rounding of coordinates of 7000 km.
    """

    def __init__(self, state: Vector, covariance: Matrix) -> None:
        """Start from a relative state (6,) and its covariance (6, 6)."""
        self.state, self.covariance = state, covariance
        self._points = filterpy().JulierSigmaPoints(6, kappa=0.0)
        self._filter = filterpy().UnscentedKalmanFilter(6, 3, 1.0, hx=None, fx=None, points=self._points)

    def predict(self, process: ProcessModel, interval: Interval, noise: Matrix) -> Matrix:
        """Propagate the points; the transition matrix is that of the mean."""
        inner = self._filter
        *_, transition = process.predict(interval, self.state, self.covariance, noise)
        points = process.propagate(interval, self._points.sigma_points(self.state, self.covariance))
        self.state, self.covariance = filterpy().unscented_transform(points, inner.Wm, inner.Wc, noise)
        restore_definiteness(self.covariance)
        return transition

    def linearize(self, readings: Readings) -> tuple[Vector, Vector, Matrix]:
        """Statistics of the readings at the points; the Jacobian is that at the mean."""
        inner = self._filter
        inner.sigmas_f = self._points.sigma_points(self.state, self.covariance)
        expected = np.array([readings.expected(point)[0] for point in inner.sigmas_f])
        innovation = readings.innovation(expected)  # by point: small numbers, and angles unwrapped
        mean = inner.Wm @ innovation
        self._linearized = readings, innovation
        variance = inner.Wc @ (innovation - mean) ** 2 + readings.variance
        return mean, variance, readings.expected(self.state)[1]

    def update(self, pseudo: bool) -> float:
        """FilterPy's update, in units of standard deviations."""
        readings, innovation = self._linearized
        noise = np.diag(readings.variance)
        offsets = -innovation
        if pseudo:
            model, values, radius = readings.model, readings.values, _radius(readings)
            slope = pseudo_jacobian(model, values)
            offsets = pseudo_measurements(model, values + offsets, radius) - pseudo_measurements(model, values, radius)
            noise = slope @ noise @ slope.T
        scale = np.sqrt(np.diag(noise))
        offsets, noise = offsets / scale, noise / (scale[:, None] * scale)
        of_points = iter(offsets)
        inner = self._filter
        inner.x, inner.P = self.state, self.covariance
        inner.update(np.zeros(offsets.shape[1]), R=noise, hx=lambda _: next(of_points))
        restore_definiteness(inner.P)
        self.state, self.covariance = inner.x, inner.P
        return float(inner.y @ inner.SI @ inner.y)


def _radius(readings: Readings) -> float:
    return sqrt(readings.chief[:3] @ readings.chief[:3])


@lru_cache(maxsize=16)
def _identity(size: int) -> Matrix:
    """Covariance of readings in units of their standard deviations."""
    return np.eye(size)


FILTERS: dict[str, Callable[[Vector, Matrix], RelativeFilter]] = {
    "ekf": ExtendedFilter,
    "ukf": UnscentedFilter,
}
"""Filters by name."""


def load(name: str) -> None:
    """Import what a filter needs, before a tick waits for it."""
    if FILTERS[name] is UnscentedFilter:
        filterpy()
