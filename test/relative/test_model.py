"""Properties of every relative-motion model."""

import math

import numpy as np
import pytest

from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import KeplerChief, OblateChief
from formation_gnc.relative.elements_model import RelativeElementsModel
from formation_gnc.relative.gim_alfriend import GimAlfriendModel
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import INPUT, RelativeModel, integrate
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.relative.registry import MODELS as REGISTRY
from formation_gnc.relative.schweighart_sedwick import SchweighartSedwickNodalModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

ELEMENTS = Elements(7.5e6, 0.05, 1.0, 0.3, 0.4, 0.5)
MODELS = [
    *(model.about(ELEMENTS) for model in dict.fromkeys(REGISTRY.values())),
    OblateModel(KeplerChief.of(ELEMENTS)),
]
STATE = np.array([1e3, 2e3, -5e2, 1.0, -2.0, 0.5])
THRUST = np.array([1e-4, -2e-4, 3e-4])
UNIT = np.repeat([1.0, 1e-3], 3)

every_model = pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)


@every_model
def test_right_hand_side_of_linear_models_is_the_matrix(model: RelativeModel):
    rate = model.derivative(50.0, STATE, THRUST)
    linear = model.dynamics(50.0, STATE) @ STATE + INPUT @ THRUST
    if model.is_linear:
        np.testing.assert_allclose(rate, linear, rtol=1e-12)
    else:
        assert np.abs(rate - linear).max() > 1e-7
    free = model.derivative(50.0, STATE)
    np.testing.assert_allclose(rate - free, INPUT @ THRUST, rtol=1e-9, atol=1e-15)


@every_model
def test_discretisation_equals_propagation_under_held_acceleration(model: RelativeModel):
    tick, time = 60.0, 100.0
    phi, gamma = model.discretise(time, tick, STATE)
    moved, free = model.propagate(time, STATE, tick, THRUST), model.propagate(time, STATE, tick)
    exact = integrate(lambda t, x: model.derivative(t, x, THRUST), time, STATE, tick, 20.0)
    # The Gim-Alfriend matrix is a theory of first order in J2: 1e-6 of 2 km.
    tolerance = 3e-3 if isinstance(model, GimAlfriendModel) else 1e-9
    np.testing.assert_allclose(moved / UNIT, exact / UNIT, atol=tolerance)
    # The thrust moves the deputy by half a metre, where gravity's second order is negligible.
    np.testing.assert_allclose((moved - free - gamma @ THRUST) / UNIT, 0.0, atol=1e-7)
    for column, step in zip(phi.T, np.diag(10.0 * UNIT), strict=True):
        ahead = model.propagate(time, STATE + step, tick)
        behind = model.propagate(time, STATE - step, tick)
        difference = (ahead - behind) / (2.0 * step.max())
        np.testing.assert_allclose(difference / UNIT, column / UNIT, rtol=1e-6, atol=1e-5)


@every_model
def test_time_invariant_models_are_marked(model: RelativeModel):
    early, late = model.transition(0.0, 500.0), model.transition(1234.5, 500.0)
    same = np.allclose(early / UNIT[:, None], late / UNIT[:, None], rtol=1e-12, atol=1e-12)
    assert same is model.is_time_invariant


@every_model
def test_propagation_is_reversible(model: RelativeModel):
    there = model.propagate(100.0, STATE, 900.0)
    back = model.propagate(1000.0, there, -900.0)
    tolerance = 3e-2 if isinstance(model, GimAlfriendModel) else 1e-7
    np.testing.assert_allclose(back / UNIT, STATE / UNIT, atol=tolerance)


@every_model
@pytest.mark.thorough
def test_bounded_start_changes_only_the_along_track_rate(model: RelativeModel):
    start = model.bounded(0.0, STATE)
    np.testing.assert_array_equal(start[[0, 1, 2, 3, 5]], STATE[[0, 1, 2, 3, 5]])

    def drift(state):
        return model.propagate(0.0, state, model.period)[1] - state[1]

    # A centimetre per second more drifts by three revolutions' worth of it.
    other = start + np.array([0, 0, 0, 0, 0.01, 0])
    drift_of_start = drift(start)
    assert abs(drift(other) - drift_of_start) == pytest.approx(0.03 * model.period, rel=0.3)
    # Where J2 rotates the perigee of the relative orbit, the position after one revolution differs by some
    # thousandths of 2 km; the mean position does not (test_oblate.py).
    turns = isinstance(model, SchweighartSedwickNodalModel | GimAlfriendModel | RelativeElementsModel) or (
        isinstance(model, OblateModel) and isinstance(model.chief, OblateChief)
    )
    assert abs(drift_of_start) < (12.0 if turns else 1e-4)


@every_model
def test_zero_state_stays_zero(model: RelativeModel):
    np.testing.assert_array_equal(model.propagate(0.0, np.zeros(6), 3000.0), np.zeros(6))


@pytest.mark.parametrize(
    ("linear", "truth"),
    [
        (HillModel(math.sqrt(MU / 7.5e6**3)), NonlinearModel(KeplerChief(7.5e6))),
        (TschaunerHempelModel(KeplerChief(1.2e7, 0.4)), NonlinearModel(KeplerChief(1.2e7, 0.4))),
        (GimAlfriendModel(ELEMENTS), OblateModel(OblateChief(ELEMENTS))),
    ],
    ids=["hill", "tschauner_hempel", "gim_alfriend"],
)
@pytest.mark.thorough
def test_error_of_a_linear_model_is_quadratic_in_the_separation(linear: RelativeModel, truth: RelativeModel):
    shape = np.array([1.0, 2.0, -1.0, 1e-3, -2e-3, 5e-4])
    errors = []
    for size in (1e3, 2e3, 4e3):
        state = truth.bounded(0.0, size * shape)
        errors.append((linear.propagate(0.0, state, 6000.0) - truth.propagate(0.0, state, 6000.0))[:3])
    # Each doubling multiplies the error by four; the next order in size / radius shifts that by 1e-3, and a
    # theory of first order in J2 leaves a linear part of 1e-6 besides.
    orders = np.diff(np.log2(np.linalg.norm(errors, axis=1)))
    np.testing.assert_allclose(orders, 2.0, atol=0.02)


def test_integration_is_of_order_eight():
    errors = []
    for steps in (8, 16):
        step = math.tau / steps
        value = integrate(lambda t, x: np.array([x[1], -x[0]]), 0.0, np.array([1.0, 0.0]), math.tau, step)
        errors.append(np.linalg.norm(value - [1.0, 0.0]))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(8.0, abs=0.7)
