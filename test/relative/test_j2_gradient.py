"""Roberts' time-varying model against the gradient of J2 and the averaged model."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_rotation
from formation_gnc.relative.chief import ChiefState, pole_in_hill_frame
from formation_gnc.relative.j2_gradient import J2GradientModel, circular_gradient
from formation_gnc.relative.oblate import oblate_gradient
from formation_gnc.relative.schweighart_sedwick import CircularReference, SchweighartSedwickModel

references = st.builds(CircularReference, st.floats(6.6e6, 4.2e7), st.floats(0.0, math.pi), st.floats(0.0, 6.28))
latitudes = st.floats(-10.0, 10.0)


@given(references, latitudes)
def test_gradient_is_that_of_j2_in_the_hill_frame(reference, latitude):
    # Roberts (12) prints it for curvilinear axes; the gradient of a vector field is the same in both.
    chief = ChiefState(MU, reference.radius, 0.0, 0.0, pole_in_hill_frame(reference.inclination, latitude))
    expected = oblate_gradient(np.zeros(6), chief) / reference.mean_motion**2
    np.testing.assert_allclose(circular_gradient(reference, latitude), expected, atol=1e-12 * reference.oblateness)


@given(st.floats(6.6e6, 4.2e7), st.floats(0.0, math.pi), st.floats(0.0, 6.28))
@pytest.mark.covers("Roberts (10)-(12); (17)-(21)", "relative/j2_gradient.py")
def test_gradient_is_the_derivative_of_the_acceleration(radius, inclination, latitude):
    # Finite differences of the inertial J2 acceleration, turned into the Hill frame: an independent check.
    state = state_from_elements(Elements(radius, 0.0, inclination, 0.7, 0.0, latitude))
    rotation = hill_rotation(state)

    def oblate(place):
        r = np.linalg.norm(place)
        ratio = 5.0 * (place[2] / r) ** 2
        return -1.5 * J2 * MU * EARTH_RADIUS**2 / r**5 * place * (np.array([1.0, 1.0, 3.0]) - ratio)

    step = 1e-4 * radius
    columns = [
        rotation @ (oblate(state[:3] + step * axis) - oblate(state[:3] - step * axis)) / (2.0 * step)
        for axis in rotation
    ]
    reference = CircularReference(radius, inclination)
    expected = np.array(columns).T / reference.mean_motion**2
    np.testing.assert_allclose(circular_gradient(reference, latitude), expected, atol=1e-5 * reference.oblateness)


@given(references, latitudes)
def test_gradient_is_symmetric_and_traceless(reference, latitude):
    gradient = circular_gradient(reference, latitude)
    np.testing.assert_array_equal(gradient, gradient.T)
    assert abs(np.trace(gradient)) < 1e-14 * reference.oblateness * 100


@given(references)
def test_average_over_an_orbit_is_the_averaged_model(reference):
    model = J2GradientModel(reference)
    times = np.arange(16) * model.period / 16  # exact for the harmonics up to the second that it has
    average = np.mean([model.dynamics(float(t)) for t in times], axis=0)
    expected = SchweighartSedwickModel(reference).dynamics()
    np.testing.assert_allclose(average, expected, atol=1e-13 * reference.mean_motion)
    np.testing.assert_allclose(average[3:, :3], expected[3:, :3], atol=1e-13 * reference.mean_motion**2)


@given(references, st.floats(0.0, 1e4))
def test_model_is_periodic_with_the_nodal_period(reference, time):
    model = J2GradientModel(reference)
    n = reference.mean_motion
    np.testing.assert_allclose(model.dynamics(time), model.dynamics(time + model.period), atol=1e-11 * n)


@given(references, st.floats(0.0, 1e4), st.floats(0.1, 1.0))
@pytest.mark.thorough
def test_transition_has_unit_determinant(reference, time, turns):
    model = J2GradientModel(reference)
    unit = np.repeat([1.0, reference.mean_motion], 3)
    phi = model.transition(time, turns * model.period) * unit / unit[:, None]
    assert abs(np.linalg.det(phi) - 1.0) < 1e-8


def test_no_motion_is_bounded_in_this_model():
    # The Floquet multipliers are off the unit circle.
    model = J2GradientModel(CircularReference(7e6, math.radians(97.87)))
    multipliers = np.linalg.eigvals(model.transition(0.0, model.period))
    assert np.abs(multipliers).max() > 1.01
    assert math.isclose(float(np.prod(multipliers).real), 1.0, abs_tol=1e-8)
    # `bounded` here: the along-track position repeats after the first revolution.
    start = model.bounded(0.0, np.array([100.0, 200.0, -50.0, 0.1, -0.2, 0.05]))
    assert math.isclose(model.propagate(0.0, start, model.period)[1], 200.0, abs_tol=1e-9)
