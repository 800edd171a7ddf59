"""Yamanaka and Ankersen's transition matrix against the integrated equations and the nonlinear ones."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import LinearModel, RelativeModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

models = st.builds(
    lambda perigee, e, anomaly: TschaunerHempelModel(KeplerChief(perigee / (1.0 - e), e, true_anomaly=anomaly)),
    st.floats(6.6e6, 4.2e7),
    st.floats(0.0, 0.8),
    st.floats(0.0, 6.28),
)
fractions = st.floats(-1.5, 1.5)  # of a revolution


def scaled(model, matrix):
    """Matrix in units where time is 1 / n."""
    unit = np.repeat([1.0, model.chief.mean_motion], 3)
    return matrix * unit / unit[:, None]


@settings(max_examples=15)
@given(models, fractions, fractions)
@pytest.mark.thorough
def test_transition_solves_the_differential_equation(model, start, turns):
    time, duration = start * model.period, turns * model.period
    closed = scaled(model, model.transition(time, duration))
    integrated = scaled(model, LinearModel.discretise(model, time, duration)[0])
    np.testing.assert_allclose(closed, integrated, atol=1e-8 * np.abs(closed).max())


@given(models, fractions, fractions, fractions)
def test_transition_is_a_group_of_unit_determinant(model, start, first, second):
    t0, t1, t2 = (np.cumsum([start, first, second]) * model.period).tolist()
    whole = scaled(model, model.transition(t0, t2 - t0))
    parts = scaled(model, model.transition(t1, t2 - t1)), scaled(model, model.transition(t0, t1 - t0))
    size = np.abs(parts[0]).max() * np.abs(parts[1]).max()
    np.testing.assert_allclose(parts[0] @ parts[1], whole, atol=1e-11 * size)
    assert np.linalg.det(parts[0]) == pytest.approx(1.0, abs=1e-12 * np.abs(parts[0]).max() ** 4 + 1e-9)


@given(models, fractions, fractions)
def test_transition_is_symplectic(model, start, turns):
    # In inertial momenta p = v + w x r the two-form is the canonical one: S(t) = [[w_hat, 1], [-1, 0]] form.
    def form(time):
        w = model.chief.at(time).angular_rate
        cross = np.array([[0.0, -w, 0.0], [w, 0.0, 0.0], [0.0, 0.0, 0.0]])
        to_momenta = np.block([[np.eye(3), np.zeros((3, 3))], [cross, np.eye(3)]])
        return to_momenta.T @ np.block([[np.zeros((3, 3)), np.eye(3)], [-np.eye(3), np.zeros((3, 3))]]) @ to_momenta

    time, duration = start * model.period, turns * model.period
    phi = model.transition(time, duration)
    unit = np.repeat([1.0, model.chief.mean_motion], 3)
    residual = (phi.T @ form(time + duration) @ phi - form(time)) * np.outer(unit, unit) / model.chief.mean_motion
    np.testing.assert_allclose(residual, 0.0, atol=1e-11 * np.abs(scaled(model, phi)).max() ** 2)


@given(st.floats(6.6e6, 4.2e7), st.floats(0.0, 6.28), fractions)
def test_model_about_a_circular_chief_is_hills(radius, anomaly, turns):
    model = TschaunerHempelModel(KeplerChief(radius, 0.0, true_anomaly=anomaly))
    hill = HillModel(model.chief.mean_motion)
    duration = turns * model.period
    expected = scaled(model, hill.transition(0.0, duration))
    np.testing.assert_allclose(
        scaled(model, model.transition(123.0, duration)), expected, atol=1e-10 * np.abs(expected).max()
    )


@given(models, fractions, st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6))
def test_bounded_motion_closes_after_one_revolution(model, start, numbers):
    unit = np.repeat([1.0, model.chief.mean_motion], 3)
    time = start * model.period
    state = model.bounded(time, np.array(numbers) * unit)
    after = model.transition(time, model.period) @ state
    size = np.abs(state / unit).max() / (1.0 - model.chief.eccentricity) ** 2
    np.testing.assert_allclose(after / unit, state / unit, atol=1e-10 * size + 1e-12)


def test_bounded_condition_is_the_default_one():
    model = TschaunerHempelModel(KeplerChief(9e6, 0.3, true_anomaly=1.0))
    state = np.array([100.0, 200.0, -50.0, 0.1, -0.2, 0.05])
    np.testing.assert_allclose(model.bounded(77.0, state), RelativeModel.bounded(model, 77.0, state), rtol=1e-10)


def test_bounded_rate_at_the_perigee_is_the_published_one():
    # Inalhan, Tillerson and How (2002): y' / x = -n (2 + e) / sqrt((1 + e) (1 - e)^3) at perigee.
    e = 0.3
    model = TschaunerHempelModel(KeplerChief(9e6, e))
    state = model.bounded(0.0, np.array([100.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    expected = -model.chief.mean_motion * (2.0 + e) / math.sqrt((1.0 + e) * (1.0 - e) ** 3)
    assert state[4] / 100.0 == pytest.approx(expected, rel=1e-12, abs=0.0)
