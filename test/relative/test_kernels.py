"""Compiled equations of motion against the models."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import KeplerChief, OblateChief
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel

CHIEF = Elements(1.2e7, 0.3, 1.0, 0.4, 0.7, 0.2)
MODELS = {
    "point mass": NonlinearModel(KeplerChief.of(CHIEF)),
    "another mu": NonlinearModel(KeplerChief(1e7, 0.1, mu=3e14)),
    "J2, chief on an ellipse": OblateModel(KeplerChief.of(CHIEF)),
    "J2": OblateModel(OblateChief(CHIEF)),
}


@pytest.mark.parametrize("name", MODELS)
@settings(max_examples=50)
@given(
    direction=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6),
    size=st.floats(-3.0, 6.5),
    time=st.floats(0.0, 1e4),
    thrust=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
)
def test_compiled_rate_and_jacobian_equal_the_models(name, direction, size, time, thrust):
    model = MODELS[name]
    state = 10.0**size * np.array(direction) * np.repeat([1.0, 1e-3], 3)
    rate, jacobian = model.motion(time, state, np.array(thrust))
    expected = model.derivative(time, state, np.array(thrust))
    # J2's difference keeps 10^-16 of J2 itself, 0.01 m/s^2; the rest is rounding of the largest term
    largest = np.abs(model.dynamics(time, state)) @ np.abs(state)
    margin = 1e-13 * largest + 1e-15 * np.abs(np.concatenate([np.zeros(3), thrust])) + 1e-17
    assert (np.abs(rate - expected) <= margin).all()
    np.testing.assert_allclose(jacobian, model.dynamics(time, state), rtol=1e-12, atol=1e-19)


def test_gravity_close_to_the_chief_has_full_precision():
    model, state = MODELS["point mass"], 1e-6 * np.ones(6)
    expected = model.derivative(0.0, state)
    assert math.isclose(model.motion(0.0, state)[0][3], expected[3], rel_tol=1e-14)
