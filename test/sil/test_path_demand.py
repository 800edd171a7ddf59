"""Thrust that it takes to follow a target path."""

from typing import Any

import numpy as np
import pytest

from formation_gnc.errors import ImpactError
from formation_gnc.sil.path_demand import path_demand, path_demand_warnings
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, find_scenario, load_scenario

SHIPPED = sorted(path.stem for path in find_scenario("leader_follower").parent.glob("*.yaml"))


def about_a_point_mass(eccentricity: float, **plant: Any) -> Scenario:
    """A hundred metres behind a chief about a point mass, at rest in its Hill frame."""
    return load_scenario(
        "leader_follower",
        {"/**": {"chief.eccentricity": eccentricity}, "/plant": {"forces.zonal_degree": 0, **plant}},
    )


def test_following_on_a_circular_orbit_about_a_point_mass_is_free() -> None:
    demand = path_demand(about_a_point_mass(0.0), "deputy1")
    assert demand.peak.max() < 1e-10  # m/s^2; difference of states of 7000 km, over ten seconds
    assert demand.delta_v < 1e-6


def test_rest_behind_an_eccentric_chief_takes_what_its_rotation_does() -> None:
    """Tschauner-Hempel, y = -d: f'' d = 2 e n^2 d sin M radially, (f'^2 - mu/r^3) d = e n^2 d cos M along the track."""
    eccentricity, distance = 0.01, 100.0
    scenario = about_a_point_mass(eccentricity)
    n = scenario.plant.mean_motion
    expected = eccentricity * n**2 * distance * np.array([2.0, 1.0, 0.0])
    peak = path_demand(scenario, "deputy1").peak
    np.testing.assert_allclose(peak, expected, rtol=0.05, atol=1e-10)  # terms of the order of e^2


@pytest.mark.parametrize("scenario", SHIPPED)
def test_thrusters_of_shipped_scenarios_follow_their_targets(scenario: str) -> None:
    assert path_demand_warnings(load_scenario(scenario)) == []


def test_a_target_beyond_the_thrusters_is_named_with_what_it_takes() -> None:
    """220 km behind on the ellipse turned, J2 left out: a newton, of 10 mN there are."""
    scenario = load_scenario("grace_fo", {"/**/controller": {"algorithm": "lqr"}})
    (warning,) = path_demand_warnings(scenario)
    assert warning.startswith("/deputy1/guidance: to follow the target takes up to 1.1 N on the radial axis, which has")
    assert "yamanaka_ankersen" in warning


def test_a_flight_that_comes_down_is_compared_until_then() -> None:
    """Perigee 100 m above the ground on the osculating ellipse, below it under J2."""
    orbit = {"chief.eccentricity": 0.08595, "chief.true_anomaly": 3.14}
    scenario = load_scenario("leader_follower", {"/**": {**orbit, "tick": 10.0}})
    with pytest.raises(ImpactError):
        Run(scenario).fly(lambda _topic, _record: None)
    demand = path_demand(scenario, "deputy1")
    assert np.isfinite(demand.peak).all()
    assert demand.peak.max() > 0.0
