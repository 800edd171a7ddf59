"""Process models of the filter."""

import numpy as np
import pytest

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.navigation.process import PROCESS_MODELS, Interval
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition

COMMON = CommonParameters(Orbit(7.2e6, 1e-4, 1.2, 0.1, 0.2, 0.3))
STATE = np.array([100.0, -200.0, 50.0, 0.01, -0.2, 0.02])
THRUST = np.array([1e-4, -1e-4, 1e-4])


def test_names_that_scenarios_give_are_offered():
    assert {"nonlinear_j2", "schweighart_sedwick", "hill"} <= set(PROCESS_MODELS)


@pytest.mark.parametrize("name", PROCESS_MODELS)
@pytest.mark.covers("Neokleous (3.1)-(3.3)", "navigation/process.py")
def test_every_process_model_predicts_a_near_circular_orbit(name: str):
    chief = state_from_elements(COMMON.chief_elements)
    deputy, thrust = inertial_from_relative(chief, STATE), THRUST @ hill_rotation(chief)
    next_chief = propagate_with_transition(chief, np.zeros(3), 10.0, 1)[0]
    truth = relative_from_inertial(next_chief, propagate_with_transition(deputy, thrust, 10.0, 1)[0])
    interval = Interval(chief, next_chief, THRUST, 10.0, 1)
    process = PROCESS_MODELS[name](COMMON)
    state, covariance, transition = process.predict(interval, STATE, np.eye(6), np.zeros((6, 6)))
    # The linear ones leave out the tilt of the orbit plane, 1e-6 rad/s over 200 m, and 1e-6 m/s^2 of gravity.
    assert state[:3] == pytest.approx(truth[:3], abs=2e-3)
    assert state[3:] == pytest.approx(truth[3:], abs=2e-5)
    assert covariance == pytest.approx(transition @ transition.T, rel=1e-9, abs=1e-12)
    assert process.propagate(interval, STATE[None])[0] == pytest.approx(state, abs=1e-9)
