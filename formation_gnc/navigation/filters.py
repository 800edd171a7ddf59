"""The filters to choose from: FilterPy's, over the relative state in the Hill frame."""

from collections.abc import Callable
from functools import lru_cache
from math import sqrt
from typing import Protocol

import numpy as np
from filterpy.kalman import (
    ExtendedKalmanFilter,
    JulierSigmaPoints,
    UnscentedKalmanFilter,
    unscented_transform,
)

from formation_gnc.navigation import kernels
from formation_gnc.navigation.measurement import Readings, pseudo_jacobian, pseudo_measurements
from formation_gnc.navigation.process import Interval, ProcessModel
from formation_gnc.types import Matrix, Vector


@lru_cache(maxsize=16)
def unit(size: int) -> Matrix:
    """Covariance of readings in their own standard deviations."""
    return np.eye(size)


class RelativeFilter(Protocol):
    """What the navigator asks of a filter. Within a tick: `fly`, then `weigh`, then `correct`."""

    x: Vector
    """(6,) relative state."""
    P: Matrix
    """(6, 6) its covariance."""

    def fly(self, process: ProcessModel, leg: Interval, noise: Matrix) -> Matrix:
        """Predict to the end of the leg; returns the transition matrix (6, 6)."""

    def weigh(self, readings: Readings) -> tuple[Vector, Vector, Matrix]:
        """Innovations (k,) of readings, the predicted variance of each (k,), and the Jacobian (k, 6)."""

    def correct(self, pseudo: bool) -> float:
        """Take the readings weighed last, and return their NIS.

        pseudo: as Neokleous' pseudo-measurements, with their noise to first order.
        """


class ExtendedFilter(ExtendedKalmanFilter):  # type: ignore[misc]
    """FilterPy's extended Kalman filter: nonlinear prediction, Joseph form."""

    def __init__(self, state: Vector, covariance: Matrix) -> None:
        """Start from a relative state (6,) and its covariance (6, 6)."""
        super().__init__(dim_x=6, dim_z=3)
        self.x, self.P = state, covariance

    def fly(self, process: ProcessModel, leg: Interval, noise: Matrix) -> Matrix:
        """Take state and covariance from the process model, which has computed F P F' + Q on the way."""
        self.x, self.P, self.F = process.predict(leg, self.x, self.P, noise)
        return self.F

    def weigh(self, readings: Readings) -> tuple[Vector, Vector, Matrix]:
        """Linearise at the predicted state."""
        expected, jacobian = readings.expected(self.x)
        innovation = readings.innovation(expected)
        self._weighed = readings, innovation, expected, jacobian
        return innovation, kernels.variances(jacobian, self.P, readings.variance), jacobian

    def correct(self, pseudo: bool) -> float:
        """FilterPy's update with what was linearised."""
        readings, innovation, expected, jacobian = self._weighed
        variance = readings.variance
        if pseudo:
            sensor = readings.sensor
            radius = sqrt(readings.chief[:3] @ readings.chief[:3])
            slope = pseudo_jacobian(sensor, expected)
            innovation = pseudo_measurements(sensor, expected + innovation, radius) - pseudo_measurements(
                sensor, expected, radius
            )
            jacobian, noise = slope @ jacobian, slope * variance @ slope.T
            variance = np.diag(noise)
            noise = noise / np.sqrt(np.outer(variance, variance))
        else:
            noise = unit(len(variance))
        # In standard deviations: variances in m^2 and rad^2 are too far apart to invert together.
        scale = np.sqrt(variance)
        jacobian = jacobian / scale[:, None]
        self.update(innovation / scale, lambda _: jacobian, lambda _: 0.0, R=noise)
        kernels.settle(self.P)
        return float(self.y @ self.SI @ self.y)


class UnscentedFilter(UnscentedKalmanFilter):  # type: ignore[misc]
    """FilterPy's unscented Kalman filter on twelve points of equal weight.

    Weights that are all positive keep the predicted covariance positive definite, and points a whole sigma
    and more away lose nothing to the rounding of coordinates of 7000 km, as points close by would.
    """

    def __init__(self, state: Vector, covariance: Matrix) -> None:
        """Start from a relative state (6,) and its covariance (6, 6)."""
        super().__init__(6, 3, 1.0, hx=None, fx=None, points=JulierSigmaPoints(6, kappa=0.0))
        self.x, self.P = state, covariance

    def fly(self, process: ProcessModel, leg: Interval, noise: Matrix) -> Matrix:
        """Move the points; the transition matrix is that of the mean."""
        *_, transition = process.predict(leg, self.x, self.P, noise)
        self.sigmas_f = process.move(leg, self.points_fn.sigma_points(self.x, self.P))
        self.x, self.P = unscented_transform(self.sigmas_f, self.Wm, self.Wc, noise)
        kernels.settle(self.P)
        return transition

    def weigh(self, readings: Readings) -> tuple[Vector, Vector, Matrix]:
        """Read at the points of the prediction."""
        self.sigmas_f = self.points_fn.sigma_points(self.x, self.P)
        expected = np.array([readings.expected(point)[0] for point in self.sigmas_f])
        innovation = readings.innovation(expected)  # by point: small numbers, and angles without a seam
        mean = self.Wm @ innovation
        self._weighed = readings, innovation
        variance = self.Wc @ (innovation - mean) ** 2 + readings.variance
        return mean, variance, readings.expected(self.x)[1]

    def correct(self, pseudo: bool) -> float:
        """FilterPy's update with what the points read."""
        readings, innovation = self._weighed
        noise = np.diag(readings.variance)
        read = -innovation
        if pseudo:
            sensor, reading = readings.sensor, readings.value
            radius = sqrt(readings.chief[:3] @ readings.chief[:3])
            slope = pseudo_jacobian(sensor, reading)
            read = pseudo_measurements(sensor, reading + read, radius) - pseudo_measurements(sensor, reading, radius)
            noise = slope @ noise @ slope.T
        scale = np.sqrt(np.diag(noise))
        read, noise = read / scale, noise / (scale[:, None] * scale)
        points = iter(read)
        self.update(np.zeros(read.shape[1]), R=noise, hx=lambda _: next(points))
        kernels.settle(self.P)
        return float(self.y @ self.SI @ self.y)


FILTERS: dict[str, Callable[[Vector, Matrix], RelativeFilter]] = {
    "ekf": ExtendedFilter,
    "ukf": UnscentedFilter,
}
"""The filters to choose from, by name."""
