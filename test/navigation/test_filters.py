"""The extended filter's update against FilterPy's."""

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter

from formation_gnc.navigation.filters import ExtendedFilter
from formation_gnc.navigation.kernels.linear_algebra import restore_definiteness
from formation_gnc.navigation.measurement import Readings, measurement_model
from formation_gnc.navigation.state_history import StateHistory

CHIEF = np.array([7.0e6, 0.0, 0.0, 0.0, 5.3e3, 5.3e3])
STATE = np.array([12.0, -100.0, 35.0, 0.01, -0.02, 0.03])
SENSORS = ("radius", "latitude", "right_ascension")


def readings(sensors: tuple[str, ...], offset: float = 0.0) -> Readings:
    """Fresh readings off what is expected by an offset, in standard deviations."""
    model = measurement_model(sensors)
    made = Readings(
        model, np.zeros(model.size), [0.0] * len(sensors), np.ones(model.size), CHIEF, StateHistory(1), False
    )
    expected, jacobian = made.expected(STATE)
    made.variance = np.einsum("ij,ij->i", jacobian, jacobian)
    made.values = expected + offset * np.sqrt(made.variance)
    return made


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.covers("Neokleous (3.4)-(3.11)", "navigation/filters.py", "navigation/navigation_filter.py")
def test_extended_update_has_the_bits_of_filterpy(count: int) -> None:
    spread = np.random.default_rng(count).standard_normal((6, 9))
    covariance = spread @ spread.T
    own = ExtendedFilter(STATE.copy(), covariance.copy())
    given = readings(SENSORS[:count], 2.5)
    innovation, _, jacobian = own.linearize(given)
    scale = np.sqrt(given.variance)
    other = ExtendedKalmanFilter(dim_x=6, dim_z=count)
    other.x, other.P = STATE.copy(), covariance.copy()
    other.update(innovation / scale, lambda _: jacobian / scale[:, None], lambda _: 0.0, R=np.eye(count))
    restore_definiteness(other.P)
    assert own.update(pseudo=False) == float(other.y @ other.SI @ other.y)
    assert np.array_equal(own.state, other.x)
    assert np.array_equal(own.covariance, other.P)


def test_update_with_a_covariance_that_is_not_finite_raises() -> None:
    own = ExtendedFilter(STATE.copy(), np.full((6, 6), np.nan))
    own.linearize(readings(SENSORS))
    with pytest.raises(ArithmeticError, match="not finite"):
        own.update(pseudo=False)
