"""Hill frame: exactness, inverses, and velocities in a rotating frame."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements, state_from_elements, true_from_mean_anomaly
from formation_gnc.orbit.frames import (
    hill_angular_velocity,
    hill_rate,
    hill_rotation,
    hill_transform,
    hill_transform_inverse,
    inertial_from_relative,
    relative_from_inertial,
)
from formation_gnc.orbit.gravity import acceleration
from formation_gnc.orbit.propagation import Propagator

CHIEF = state_from_elements(Elements(9e6, 0.2, 1.1, 0.7, 2.1, 0.9))


@st.composite
def chiefs(draw):
    eccentricity = draw(st.sampled_from([0.0, 0.01, 0.7]))
    angles = [draw(st.floats(0.0, 6.2)) for _ in range(3)]
    inclination = draw(st.sampled_from([0.0, 0.5, pi / 2, pi]))
    return state_from_elements(Elements(7e6 / (1 - eccentricity), eccentricity, inclination, *angles))


RELATIVE = st.tuples(*[st.floats(-1e5, 1e5)] * 3, *[st.floats(-100, 100)] * 3).map(np.array)


@given(chiefs(), RELATIVE)
@pytest.mark.covers("Joshi (3.16)", "orbit/frames.py")
def test_relative_state_to_inertial_and_back_is_the_same_state(chief, relative):
    again = relative_from_inertial(chief, inertial_from_relative(chief, relative))
    # A few parts in 1e16 of the orbit's radius, up to 4e7 m, and speed.
    assert np.abs(again - relative)[:3].max() < 5e-8
    assert np.abs(again - relative)[3:].max() < 5e-11


@given(chiefs(), RELATIVE)
def test_transform_matrix_equals_the_exact_map(chief, relative):
    deputy = inertial_from_relative(chief, relative)
    assert hill_transform(chief) @ (deputy - chief) == pytest.approx(relative_from_inertial(chief, deputy), abs=1e-7)
    assert hill_transform(chief) @ hill_transform_inverse(chief) == pytest.approx(np.eye(6), abs=1e-14)


@given(chiefs())
@pytest.mark.covers("Joshi Fig. 3.2; Fig. 3.3", "orbit/frames.py", differs="a drawing: its axes are ours")
def test_hill_axes_are_radial_along_track_and_normal(chief):
    rotation = hill_rotation(chief)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    radius, speed = np.linalg.norm(chief[:3]), np.linalg.norm(chief[3:])
    assert rotation @ chief[:3] == pytest.approx([radius, 0, 0], abs=1e-14 * radius)
    velocity = rotation @ chief[3:]
    assert velocity[1] > 0.0
    assert abs(velocity[2]) < 1e-14 * speed
    assert hill_rate(chief) == pytest.approx(velocity[1] / radius)


@pytest.mark.covers(
    "Kremmydas Fig. 1.8",
    "orbit/frames.py",
    "guidance/formation.py",
    differs="a drawing: ESA's axes, turned into Hill's",
)
def test_relative_velocity_is_the_derivative_of_relative_position():
    """Without forces out of its plane the frame turns at h/r^2 alone: checked on the conic itself."""
    eccentricity, axis = 0.3, 1e7
    mean_motion = np.sqrt(MU / axis**3)

    def at(time, node, phase):
        anomaly = true_from_mean_anomaly(mean_motion * time + phase, eccentricity)
        return state_from_elements(Elements(axis, eccentricity, 1.0, node, 0.4, anomaly))

    def relative(time):
        return relative_from_inertial(at(time, 0.3, 0.5), at(time, 0.301, 0.502))

    step = 1.0
    derivative = (relative(step)[:3] - relative(-step)[:3]) / (2 * step)
    # Second-order difference of a 10 km separation that varies at 1e-3 rad/s: n^3 step^2 rho / 6.
    assert derivative == pytest.approx(relative(0.0)[3:], abs=1e-5)


def test_under_j2_the_derivative_differs_by_the_orbit_planes_tilt():
    """The documented convention, by finite differences of propagated orbits."""
    relative = np.array([300.0, -500.0, 400.0, 0.1, -0.2, 0.3])
    states = np.array([CHIEF, inertial_from_relative(CHIEF, relative)])
    step = 0.5
    after = Propagator(step).propagate(0.0, states, np.zeros((2, 3)))
    before = Propagator(step).propagate(0.0, states * [1, 1, 1, -1, -1, -1], np.zeros((2, 3)))
    before = before * [1, 1, 1, -1, -1, -1]  # gravity is symmetric under time reversal
    derivative = (relative_from_inertial(*after)[:3] - relative_from_inertial(*before)[:3]) / (2 * step)
    tilt = hill_angular_velocity(CHIEF, acceleration(CHIEF[:3])) * [1, 0, 0]
    expected = relative[3:] - np.cross(tilt, relative[:3])
    assert np.linalg.norm(np.cross(tilt, relative[:3])) > 5e-5
    assert derivative == pytest.approx(expected, abs=2e-6)


def test_chief_without_an_orbit_plane_is_rejected():
    with pytest.raises(OrbitError, match="no orbit plane"):
        hill_rotation(np.array([7e6, 0.0, 0.0, 1.0, 0.0, 0.0]))
    with pytest.raises(OrbitError, match="no orbit plane"):
        hill_rotation(np.zeros(6))
