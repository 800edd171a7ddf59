"""The formations that need no thrust in Hill's equations, and the guide that propagates them."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.formation import Formation
from formation_gnc.guidance.guidance import Guidance, GuidanceParameters
from formation_gnc.guidance.leader_follower import LeaderFollower, LeaderFollowerParameters
from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.parameters import load
from formation_gnc.records import NavigationState
from formation_gnc.types import NANOSECONDS

Array = NDArray[np.float64]

MISSION = CommonParameters(Orbit(7.0e6))
OMEGA = MISSION.mean_motion
ORBIT = 2.0 * math.pi / OMEGA
RATES = np.repeat([1.0, OMEGA], 3)  # a metre, and the speed that goes with it over a radian

metres = st.floats(-1e4, 1e4)
slopes = st.floats(-3.0, 3.0)
relative_orbits = st.builds(
    RelativeOrbitParameters,
    rho=st.floats(0.0, 1e4),
    theta=st.floats(-10.0, 10.0),
    a=metres,
    b=metres,
    m=slopes,
    n=slopes,
).map(lambda parameters: RelativeOrbit(parameters, OMEGA))
leader_followers = st.builds(LeaderFollowerParameters, separation=metres).map(
    lambda parameters: LeaderFollower(parameters, OMEGA)
)
free_formations = relative_orbits | leader_followers
times = st.floats(0.0, 1e5)


def hill_matrix() -> Array:
    """Hill's equations as printed everywhere: x'' = 3 w^2 x + 2 w y', y'' = -2 w x', z'' = -w^2 z."""
    matrix = np.zeros((6, 6))
    matrix[:3, 3:] = np.eye(3)
    matrix[3, [0, 4]] = 3.0 * OMEGA**2, 2.0 * OMEGA
    matrix[4, 3] = -2.0 * OMEGA
    matrix[5, 2] = -(OMEGA**2)
    return matrix


def size(formation: Formation, *at: float) -> float:
    """Largest position or speed times radian, m: what rounding is in proportion to."""
    return float(np.abs(formation.states(np.array(at)) / RATES).max()) + 1.0


@given(free_formations, times, st.floats(1.0, 6000.0))
def test_the_formation_is_a_free_solution_of_hills_equations(
    formation: Formation, start: float, duration: float
) -> None:
    before, after = formation.states(np.array([start, start + duration]))
    flown = expm(hill_matrix() * duration) @ before
    # the matrix exponential, scaled by the rates, keeps some 1e-12; phases of 1e2 rad lose as much
    assert flown / RATES == pytest.approx(after / RATES, abs=1e-10 * size(formation, start, start + duration))


@given(free_formations, times)
def test_velocities_are_the_time_derivatives_of_positions(formation: Formation, time: float) -> None:
    # Joshi 4.17 as printed lacks a factor omega, which this would see at once
    step = 1e-3 * ORBIT / (2.0 * math.pi)
    behind, now, ahead = formation.states(np.array([time - step, time, time + step]))
    slope = (ahead[:3] - behind[:3]) / (2.0 * step)
    # central difference over 1e-3 rad: (1e-3)^2 / 6, and rounding of the positions over the step
    assert slope / OMEGA == pytest.approx(now[3:] / OMEGA, abs=1e-6 * size(formation, time))


@given(relative_orbits)
def test_a_relative_orbit_closes_but_for_a_drift_of_three_pi_times_the_radial_offset(
    formation: RelativeOrbit,
) -> None:
    first, last = formation.states(np.array([100.0, 100.0 + ORBIT]))
    offset = formation.states(np.linspace(0.0, ORBIT, 8, endpoint=False))[:, 0].mean()
    drift = np.array([0.0, -3.0 * math.pi * offset, 0.0])
    assert last[:3] - first[:3] == pytest.approx(drift, abs=1e-10 * size(formation, 100.0))


def test_the_relative_orbit_is_an_ellipse_of_two_to_one_in_a_tilted_plane() -> None:
    parameters = RelativeOrbitParameters(rho=500.0, theta=0.3, b=-200.0, m=0.4, n=-0.7)
    x, y, z, *_ = RelativeOrbit(parameters, OMEGA).states(np.linspace(0.0, ORBIT, 50)).T
    assert x**2 + ((y + 200.0) / 2.0) ** 2 == pytest.approx(500.0**2)
    assert z == pytest.approx(0.4 * x - 0.7 * (y + 200.0))
    assert x[0] == pytest.approx(500.0 * math.sin(0.3))


def test_a_relative_orbit_projects_to_a_circle_as_seen_from_the_earth_when_its_slope_is_two() -> None:
    y, z = RelativeOrbit(RelativeOrbitParameters(rho=500.0, m=2.0), OMEGA).states(np.linspace(0, ORBIT, 50)).T[1:3]
    assert np.hypot(y, z) == pytest.approx(1000.0)


@given(metres, st.lists(times, max_size=5))
def test_the_follower_stays_where_it_is_behind_the_leader(separation: float, at: list[float]) -> None:
    states = LeaderFollower(LeaderFollowerParameters(separation), OMEGA).states(np.array(at))
    assert states.tolist() == [[0.0, -separation, 0.0, 0.0, 0.0, 0.0]] * len(at)


def guide(**values: Any) -> Guidance:
    given_values = {name.replace("__", "."): value for name, value in values.items()}
    return Guidance("/deputy1/guidance", load(GuidanceParameters, {"chief.semi_major_axis": 7.0e6} | given_values))


@pytest.fixture(scope="module")
def at() -> Callable[[float], NavigationState]:
    """An estimate at a time in s."""

    def build(second: float) -> NavigationState:
        return NavigationState(round(second * NANOSECONDS), np.zeros(6), np.zeros(6), 100.0)

    return build


def test_the_target_is_the_formations_state_at_the_stamp(at: Callable[[float], NavigationState]) -> None:
    target = guide(formation="relative_orbit", relative_orbit__rho=300.0).on_tick(at(77.0))[0]
    formation = RelativeOrbit(RelativeOrbitParameters(rho=300.0), OMEGA)
    assert (target.time, target.formation) == (77 * NANOSECONDS, "relative_orbit")
    assert target.relative_state.tolist() == formation.states(np.array([77.0]))[0].tolist()
    assert target.preview.shape == (0, 6)


def test_the_preview_is_where_the_target_will_be(at: Callable[[float], NavigationState]) -> None:
    ahead = guide(formation="relative_orbit", preview_steps=4, preview_step=30.0)
    preview = ahead.on_tick(at(10.0))[0].preview
    later = [ahead.on_tick(at(10.0 + 30.0 * step))[0].relative_state.tolist() for step in (1, 2, 3, 4)]
    assert preview.tolist() == later


def test_a_formation_is_swapped_in_flight_at_a_tick(at: Callable[[float], NavigationState]) -> None:
    swapped = guide(schedule=["{at: 20, formation: relative_orbit, relative_orbit.rho: 50}"])
    assert swapped.on_tick(at(19.0))[0].relative_state.tolist() == [0.0, -100.0, 0.0, 0.0, 0.0, 0.0]
    target, _ = swapped.on_tick(at(20.0))
    assert target.formation == "relative_orbit"
    assert np.abs(target.relative_state[0]) <= 50.0
    swapped.commit(swapped.stage({"formation": "leader_follower", "leader_follower.separation": 40.0}))
    assert swapped.on_tick(at(21.0))[0].relative_state.tolist() == [0.0, -40.0, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "constants", [{"rho": 1e308}, {"a": -1e9}, {"b": 1e300}, {"m": 1e200, "rho": 1e200}, {"n": 1e7}]
)
def test_a_formation_whose_targets_would_overflow_is_rejected(constants: dict[str, float]) -> None:
    values = {f"relative_orbit__{name}": value for name, value in constants.items()}
    with pytest.raises(ConfigurationError, match="formation relative_orbit: its parameters put a target"):
        guide(formation="relative_orbit", **values)
    guide(formation="leader_follower", **values)  # what does not fly may be anything
