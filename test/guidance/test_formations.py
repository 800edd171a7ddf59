"""Relative orbit and leader-follower as free solutions of Hill's equations."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.guidance.formation import Formation
from formation_gnc.guidance.leader_follower import LeaderFollower, LeaderFollowerParameters
from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters

Array = NDArray[np.float64]

OMEGA = CommonParameters(Orbit(7.0e6)).mean_motion
ORBIT = 2.0 * math.pi / OMEGA
RATES = np.repeat([1.0, OMEGA], 3)  # scales velocities to lengths over a radian

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
formations = relative_orbits | leader_followers
times = st.floats(0.0, 1e5)


def hill_matrix() -> Array:
    """Hill's equations: x'' = 3 w^2 x + 2 w y', y'' = -2 w x', z'' = -w^2 z."""
    matrix = np.zeros((6, 6))
    matrix[:3, 3:] = np.eye(3)
    matrix[3, [0, 4]] = 3.0 * OMEGA**2, 2.0 * OMEGA
    matrix[4, 3] = -2.0 * OMEGA
    matrix[5, 2] = -(OMEGA**2)
    return matrix


def size(formation: Formation[Any], *at: float) -> float:
    """Largest position, or velocity over a radian, m: the scale of rounding errors."""
    return float(np.abs(formation.states(np.array(at)) / RATES).max()) + 1.0


@given(formations, times, st.floats(1.0, 6000.0))
@pytest.mark.covers("Kremmydas 3.2, force-free formation", "guidance/formation.py")
def test_formation_is_a_free_solution_of_hills_equations(
    formation: Formation[Any], start: float, duration: float
) -> None:
    before, after = formation.states(np.array([start, start + duration]))
    propagated = expm(hill_matrix() * duration) @ before
    # the matrix exponential is good to 1e-12; so is a phase of 1e2 rad
    assert propagated / RATES == pytest.approx(after / RATES, abs=1e-10 * size(formation, start, start + duration))


@given(formations, times)
def test_velocity_is_the_time_derivative_of_position(formation: Formation[Any], time: float) -> None:
    # fails for Joshi 4.17 as printed, without the factor omega
    step = 1e-3 * ORBIT / (2.0 * math.pi)
    behind, now, ahead = formation.states(np.array([time - step, time, time + step]))
    slope = (ahead[:3] - behind[:3]) / (2.0 * step)
    # central difference over 1e-3 rad: (1e-3)^2 / 6, and rounding of the positions over the step
    assert slope / OMEGA == pytest.approx(now[3:] / OMEGA, abs=1e-6 * size(formation, time))


@given(relative_orbits)
def test_relative_orbit_drifts_by_three_pi_radial_offsets_an_orbit(
    formation: RelativeOrbit,
) -> None:
    first, last = formation.states(np.array([100.0, 100.0 + ORBIT]))
    offset = formation.states(np.linspace(0.0, ORBIT, 8, endpoint=False))[:, 0].mean()
    drift = np.array([0.0, -3.0 * math.pi * offset, 0.0])
    assert last[:3] - first[:3] == pytest.approx(drift, abs=1e-10 * size(formation, 100.0))


@pytest.mark.covers("Joshi Fig. 3.4", "guidance/relative_orbit.py", differs="a drawing: its ellipse is ours")
def test_relative_orbit_is_a_two_to_one_ellipse_in_a_tilted_plane() -> None:
    parameters = RelativeOrbitParameters(rho=500.0, theta=0.3, b=-200.0, m=0.4, n=-0.7)
    x, y, z, *_ = RelativeOrbit(parameters, OMEGA).states(np.linspace(0.0, ORBIT, 50)).T
    assert x**2 + ((y + 200.0) / 2.0) ** 2 == pytest.approx(500.0**2)
    assert z == pytest.approx(0.4 * x - 0.7 * (y + 200.0))
    assert x[0] == pytest.approx(500.0 * math.sin(0.3))


def test_relative_orbit_of_slope_two_projects_to_a_circle() -> None:
    y, z = RelativeOrbit(RelativeOrbitParameters(rho=500.0, m=2.0), OMEGA).states(np.linspace(0, ORBIT, 50)).T[1:3]
    assert np.hypot(y, z) == pytest.approx(1000.0)


@given(metres, st.lists(times, max_size=5))
@pytest.mark.covers("Kremmydas 3.2, along the orbit", "guidance/leader_follower.py")
def test_follower_is_at_rest_behind_the_chief(separation: float, at: list[float]) -> None:
    states = LeaderFollower(LeaderFollowerParameters(separation), OMEGA).states(np.array(at))
    assert states.tolist() == [[0.0, -separation, 0.0, 0.0, 0.0, 0.0]] * len(at)
