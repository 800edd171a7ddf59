"""Targets at any separation: formations are curvilinear, and given states are kept."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.guidance.curvilinear import curvilinear_from_hill, hill_from_curvilinear
from formation_gnc.guidance.leader_follower import LeaderFollower, LeaderFollowerParameters
from formation_gnc.guidance.slot_list import SlotList, SlotListParameters
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements, mean_from_true_anomaly, state_from_elements, true_from_mean_anomaly
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial

Array = NDArray[np.float64]

angles = st.floats(-math.pi, math.pi)


def orbit(semi_major_axis: float = 6873.5e3, eccentricity: float = 0.0, anomaly: float = 0.4) -> CommonParameters:
    return CommonParameters(Orbit(semi_major_axis, eccentricity, 1.5, 0.3, 0.2, anomaly))


def behind(separation: float, model: str, common: CommonParameters) -> TargetPath:
    formation = LeaderFollower(LeaderFollowerParameters(separation), common.mean_motion)
    return TARGET_MODELS[model](formation, 0.0, common)


def slot(state: list[float], model: str, common: CommonParameters) -> TargetPath:
    formation = SlotList(SlotListParameters(tuple(state)), common.mean_motion)
    return TARGET_MODELS[model](formation, 0.0, common)


def after(elements: Elements, time: float, turned: float = 0.0) -> Array:
    """Inertial state on an ellipse after a time (s), turned about the orbit normal."""
    e = elements.eccentricity
    mean = mean_from_true_anomaly(elements.true_anomaly, e) + elements.mean_motion * time
    perigee, anomaly = elements.argument_of_perigee + turned, true_from_mean_anomaly(mean, e)
    return state_from_elements(
        Elements(elements.semi_major_axis, e, elements.inclination, elements.right_ascension, perigee, anomaly)
    )


@pytest.mark.parametrize("separation", [100.0, 220e3, -2000e3])
@pytest.mark.parametrize(("model", "eccentricity"), [("hill", 0.0), ("yamanaka_ankersen", 0.3)])
def test_a_follower_is_on_the_leaders_orbit_turned(model: str, eccentricity: float, separation: float) -> None:
    """A satellite on its target stays on it, at any separation: the target is a solution of two-body motion."""
    common = orbit(12000e3, eccentricity)
    leader, target = common.chief_elements, behind(separation, model, common)
    times = np.linspace(0.0, 2.0 * math.tau / common.mean_motion, 9)
    turned = -separation / float(np.linalg.norm(after(leader, 0.0)[:3]))
    for time, state in zip(times, target.states(times), strict=True):
        exact = relative_from_inertial(after(leader, time), after(leader, time, turned))
        assert state == pytest.approx(exact, abs=1e-5)  # rounding over thousands of kilometres


def test_a_small_formation_differs_by_the_curvature_alone() -> None:
    common = orbit(6978.1e3)
    assert behind(100.0, "hill", common).states(np.zeros(1))[0, :3] == pytest.approx([-7.165e-4, -100.0, 0.0], abs=1e-7)


@given(
    st.lists(st.floats(-2e6, 2e6), min_size=3, max_size=3),
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
    st.floats(0.0, 0.95),
    angles,
    st.floats(-1e5, 1e5),
)
def test_curvilinear_coordinates_and_hill_frame_invert(
    position: list[float], velocity: list[float], eccentricity: float, anomaly: float, ahead: float
) -> None:
    common = orbit(12000e3 / (1.0 - eccentricity), eccentricity, anomaly)
    chief, times = after(common.chief_elements, 0.0), np.array([ahead])
    state = np.array([[*position, *velocity]])
    there = curvilinear_from_hill(state, chief, times, MU)
    assert hill_from_curvilinear(there, chief, times, MU) == pytest.approx(state, abs=1e-6)
    later = after(common.chief_elements, ahead)
    now = curvilinear_from_hill(state, later, np.zeros(1), MU)
    assert there == pytest.approx(now, rel=1e-6, abs=1e-3)  # Kepler's equation after many revolutions


# MMS: four satellites at the apogee of an orbit of 1.2 by 12 Earth radii, without drift
APOGEE = [
    [3535.5339059327375, 3535.5339059327375, 3535.5339059327375, 0.0, -0.29266624091614196, 0.0],
    [-3535.5339059327375, -3535.5339059327375, 3535.5339059327375, 0.0, 0.29266624091614196, 0.0],
]


@pytest.mark.parametrize("state", APOGEE)
def test_a_given_state_without_drift_is_kept(state: list[float]) -> None:
    """About an eccentric chief it is none of Hill's; a deputy on it returns after a revolution."""
    common = orbit(42048.6e3, 0.8181818181818182, math.pi)
    target = slot(state, "yamanaka_ankersen", common)
    assert target.states(np.zeros(1))[0] == pytest.approx(state, abs=1e-8)
    period = math.tau / common.mean_motion
    first, last = target.states(np.array([0.0, period]))
    assert last == pytest.approx(first, abs=1.0)  # the linear condition, at a ten-thousandth of the distance
    assert target.error()[0] < 0.02 * target.error()[1]


def test_a_given_state_far_behind_on_the_same_orbit_is_kept() -> None:
    """GRACE: the follower is on the leader's ellipse, 220 km behind, and stays there as long as it coasts."""
    common = orbit(eccentricity=0.00182)
    leader = common.chief_elements
    delay = 220e3 / (common.mean_motion * 6873.5e3)
    state = relative_from_inertial(after(leader, 0.0), after(leader, -delay))
    target = slot(state.tolist(), "yamanaka_ankersen", common)
    times = np.linspace(0.0, math.tau / common.mean_motion, 13)
    exact = [relative_from_inertial(after(leader, time), after(leader, time - delay)) for time in times]
    missed = np.linalg.norm((target.states(times) - np.array(exact))[:, :3], axis=1)
    assert missed[0] < 1e-6
    assert missed.max() < 30.0  # e (s/a)^2 a, the products that a linear model leaves out


def test_a_state_without_drift_in_hills_equations_is_bounded_in_others() -> None:
    common = orbit(7000e3)
    n, period = common.mean_motion, math.tau / common.mean_motion
    target = slot([100.0, 0.0, 0.0, 0.0, -200.0 * n, 0.0], "j2_mean_motion", common)
    first, last = target.states(np.array([0.0, 100.0 * period]))
    assert abs(last[1] - first[1]) < 300.0  # of an ellipse of 200 m; at Hill's rates it would drift by kilometres


def test_a_deputy_far_from_the_chief_coasts_along_the_orbit() -> None:
    common = orbit()
    target = behind(500e3, "hill", common)
    states = target.states(np.zeros(1))
    later = np.array([0.0, 3000.0, 1e5])
    assert target.coast(states, 0.0, later)[:, 0] == pytest.approx(target.states(later), abs=1e-5)
    deputy = inertial_from_relative(after(common.chief_elements, 0.0), states[0])
    assert float(np.linalg.norm(deputy[:3])) == pytest.approx(6873.5e3, abs=1e-6)
