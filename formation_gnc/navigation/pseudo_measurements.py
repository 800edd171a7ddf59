"""Pseudo-measurements of Neokleous (3.13), in place of radius, range rate and latitude."""

import numpy as np

from formation_gnc.navigation.measurement import MeasurementModel
from formation_gnc.types import Matrix, Vector

TRANSFORMED = ("radius", "range_rate", "latitude")
"""Sensors whose readings they are made from."""


def applies_to(model: MeasurementModel) -> bool:
    """Whether all three sensors are among the readings."""
    return set(model.sensors) >= set(TRANSFORMED)


def pseudo_measurements(model: MeasurementModel, values: Vector, chief_radius: float) -> Vector:
    """Transform readings.

    y1 = r^2 - r_c^2, y2 = (1/2) d(r^2)/dt = r r', y3 = r sin(latitude). The last is the height above the equator:
    the cross-track position only about an equatorial chief.

    Args:
        model: of the readings, with one of each of the three sensors.
        values: of the readings, (..., m).
        chief_radius: m.

    Returns:
        (..., m): m^2, m^2/s and m in place of the three, other values unchanged.
    """
    radius_row, rate_row, latitude_row = ([row] for row in _rows(model))
    out = values.copy()
    radius = values[..., radius_row]
    out[..., radius_row] = (radius - chief_radius) * (radius + chief_radius)
    out[..., rate_row] = radius * values[..., rate_row]
    out[..., latitude_row] = radius * np.sin(values[..., latitude_row])
    return out


def pseudo_jacobian(model: MeasurementModel, values: Vector) -> Matrix:
    """Derivative (m, m) of `pseudo_measurements` with respect to the readings' values (m,)."""
    radius_row, rate_row, latitude_row = _rows(model)
    radius, rate, latitude = values[radius_row], values[rate_row], values[latitude_row]
    out = np.eye(model.size)
    out[radius_row, radius_row] = 2.0 * radius
    out[rate_row, rate_row], out[rate_row, radius_row] = radius, rate
    out[latitude_row, latitude_row], out[latitude_row, radius_row] = radius * np.cos(latitude), np.sin(latitude)
    return out


def _rows(model: MeasurementModel) -> list[int]:
    return [model.rows[model.sensors.index(name)].start for name in TRANSFORMED]
