"""Relative navigation of one deputy by an extended Kalman filter."""

from dataclasses import dataclass

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from formation_gnc.interface import NANOSECONDS, Estimate, EstimateStatus, Measurement, Sensor, Vector
from formation_gnc.navigation.measurement import predicted_readings
from formation_gnc.orbit.frames import (
    hill_rotation,
    hill_transform,
    hill_transform_inverse,
    inertial_from_relative,
    relative_from_inertial,
)
from formation_gnc.orbit.propagation import advance_with_transition
from formation_gnc.parameters import parameter
from formation_gnc.part import Part, Schedulable


@dataclass(frozen=True)
class NavigationParameters(Schedulable):
    """What the filter believes of its sensors, its start and its model."""

    radius_sigma: float = parameter(
        5.0, unit="m", above=0.0, in_flight=True, doc="standard deviation of the radius reading"
    )
    range_rate_sigma: float = parameter(
        0.01, unit="m/s", above=0.0, in_flight=True, doc="standard deviation of the range-rate reading"
    )
    latitude_sigma: float = parameter(
        1e-6, unit="rad", above=0.0, in_flight=True, doc="standard deviation of the latitude reading"
    )
    fix_position_sigma: float = parameter(
        0.5, unit="m", above=0.0, doc="standard deviation of an acquisition fix, each axis"
    )
    fix_velocity_sigma: float = parameter(
        0.0005, unit="m/s", above=0.0, doc="standard deviation of an acquisition fix, each axis"
    )
    acceleration_density: float = parameter(
        1e-14, unit="m^2/s^3", minimum=0.0, in_flight=True, doc="power density of the unmodelled acceleration, each axis"
    )


@dataclass(frozen=True)
class NoiseModel:
    """Noise of the readings and of the process, ready for use."""

    variance: dict[int, float]
    """Of each sensor's reading."""
    process: np.ndarray
    """(6, 6) covariance that the unmodelled acceleration adds over a tick."""


class RelativeFilter(ExtendedKalmanFilter):  # type: ignore[misc]
    """FilterPy's EKF over the relative state in the Hill frame, with the exact motion under gravity with J2.

    The prediction flies the deputy in the inertial frame beside the chief's ephemeris, so that it assumes neither a circular
    chief nor a small separation; the transition matrix is that of the inertial flight, seen in the Hill frames at both ends.
    """

    def __init__(self, state: Vector, chief_state: Vector) -> None:
        """Start from a relative state (6,) at the time of the chief's inertial state (6,)."""
        super().__init__(dim_x=6, dim_z=3)
        self.x = state.copy()
        self.chief_state = chief_state
        self._predicted = self.x

    def fly(self, chief_state: Vector, acceleration: Vector, tick: float) -> None:
        """Predict over a tick, at whose end the chief has the given inertial state.

        Args:
            chief_state: (6,) m and m/s.
            acceleration: (3,) by thrust, along the Hill axes at the tick's start, m/s^2.
            tick: s.
        """
        old = self.chief_state
        deputy, transition = advance_with_transition(
            inertial_from_relative(old, self.x), acceleration @ hill_rotation(old), tick, 1
        )
        self._predicted = relative_from_inertial(chief_state, deputy)
        self.F = hill_transform(chief_state) @ transition @ hill_transform_inverse(old)
        self.chief_state = chief_state
        self.predict()

    def predict_x(self, u: float = 0) -> None:
        """Take the nonlinear prediction; FilterPy's own would be F x."""
        self.x = self._predicted


class Navigator(Part[NavigationParameters, NoiseModel]):
    """Filter of one deputy, from measurement to estimate.

    It starts from the acquisition fix of a first tick, or of the tick after a missed one when it has lost its state.
    """

    def __init__(self, name: str, parameters: NavigationParameters) -> None:
        """Without a state until a fix comes."""
        super().__init__(name, parameters)
        self._filter_time = -1
        self._filter: RelativeFilter | None = None

    def design(self, parameters: NavigationParameters) -> NoiseModel:
        """Noise of the readings as variances, of the process integrated over a tick."""
        tick, density, unit = parameters.tick, parameters.acceleration_density, np.eye(3)
        return NoiseModel(
            {
                int(Sensor.RADIUS): parameters.radius_sigma**2,
                int(Sensor.RANGE_RATE): parameters.range_rate_sigma**2,
                int(Sensor.LATITUDE): parameters.latitude_sigma**2,
            },
            density
            * np.block([[tick**3 / 3.0 * unit, tick**2 / 2.0 * unit], [tick**2 / 2.0 * unit, tick * unit]]),
        )

    def on_tick(self, measurement: Measurement) -> Estimate | None:
        """The estimate at the measurement's stamp; none while there is no state to start from."""
        self.begin_tick(measurement.time)
        restart = self._filter is None or measurement.time <= self._filter_time
        if restart and not measurement.fix_available:
            return None
        if restart:
            self._acquire(measurement)
        else:
            self._predict(measurement)
        self._filter_time = measurement.time
        return self._update(measurement, EstimateStatus.ACQUIRED if restart else EstimateStatus.TRACKING)

    def _acquire(self, measurement: Measurement) -> None:
        parameters = self.parameters
        self._filter = RelativeFilter(measurement.fix, measurement.chief_state)
        self._filter.P = np.diag(
            np.repeat([parameters.fix_position_sigma**2, parameters.fix_velocity_sigma**2], 3)
        )
        self.record(measurement.time, "acquired", "filter started from an acquisition fix")

    def _predict(self, measurement: Measurement) -> None:
        assert self._filter is not None
        self._filter.Q = self.configuration.design.process
        tick_ns = self.parameters.tick_ns
        tick = tick_ns / NANOSECONDS
        # Ticks that never arrived were missed ones: no thrust, and the chief flew on as the model says.
        for _ in range((measurement.time - self._filter_time) // tick_ns - 1):
            chief, _ = advance_with_transition(self._filter.chief_state, np.zeros(3), tick, 1)
            self._filter.fly(chief, np.zeros(3), tick)
        self._filter.fly(measurement.chief_state, measurement.applied_force / measurement.mass, tick)

    def _update(self, measurement: Measurement, status: EstimateStatus) -> Estimate:
        ekf = self._filter
        assert ekf is not None
        innovation: list[float] = []
        sigma: list[float] = []
        nis = 0.0
        if measurement.sensor:
            variance = self.configuration.design.variance
            predicted, inertial_jacobian = predicted_readings(
                measurement.sensor, inertial_from_relative(measurement.chief_state, ekf.x)
            )
            jacobian = inertial_jacobian @ hill_transform_inverse(measurement.chief_state)
            ekf.update(
                np.array(measurement.reading),
                lambda _: jacobian,
                lambda _: predicted,
                R=np.diag([variance[sensor] for sensor in measurement.sensor]),
            )
            ekf.P = 0.5 * (ekf.P + ekf.P.T)  # rounding must not pile up over a long flight
            innovation = ekf.y.tolist()
            sigma = np.sqrt(np.diag(ekf.S)).tolist()
            nis = float(ekf.y @ ekf.SI @ ekf.y)
        return Estimate(
            time=measurement.time,
            relative_state=ekf.x,
            covariance=ekf.P,
            chief_state=measurement.chief_state,
            mass=measurement.mass,
            eclipse=measurement.eclipse,
            sensor=list(measurement.sensor),
            innovation=innovation,
            innovation_sigma=sigma,
            nis=nis,
            status=int(status),
        )
