"""Forecast of the recovery from the error at the start."""

import numpy as np
import pytest

from formation_gnc.sil.recovery_forecast import initial_errors, recovery_warnings
from formation_gnc.sil.scenario import load_scenario

SCENARIOS = ["leader_follower", "geostationary", "eccentric_leo", "tetrahedral", "projected_circle"]


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_laws_of_shipped_scenarios_recover(scenario: str) -> None:
    assert recovery_warnings(load_scenario(scenario)) == []


def test_initial_errors_are_from_the_slots_that_guidance_assigns() -> None:
    errors = initial_errors(load_scenario("projected_circle"))
    assert max(np.linalg.norm(error[:3]) for error in errors.values()) < 20.0  # as the file's comment says, metres


def circle(**controller: object) -> list[str]:
    """Warnings of `leader_follower` flown to a circle of 500 m from 90 m behind."""
    guidance = {"formation": "projected_circular_orbit", "projected_circular_orbit.size": 500.0}
    return recovery_warnings(load_scenario("leader_follower", {"/**/guidance": guidance, "/**/controller": controller}))


def test_lqr_with_any_weights_recovers_from_half_a_kilometre() -> None:
    strict = {"lqr.position_error": [1.0] * 3, "lqr.velocity_error": [0.01] * 3, "lqr.thrust": [0.01] * 3}
    assert circle(**strict) == []


def test_a_law_that_loses_the_formation_is_named_before_the_flight() -> None:
    """With strict weights a plan over five minutes does not see how an orbit's drift is stopped with 10 mN."""
    strict = {"mpc.position_error": [1.0] * 3, "mpc.velocity_error": [0.01] * 3, "mpc.thrust": [0.01] * 3}
    (warning,) = circle(algorithm="mpc", **strict, **{"mpc.horizon": 5})
    start = "/deputy1/controller: mpc is not expected to take back the "
    assert warning.startswith(start)
    assert "the least time is" in warning
    assert "; lqr takes" in warning


@pytest.mark.thorough
def test_an_error_out_of_reach_is_named() -> None:
    (warning,) = circle(thrust_limit=[1e-6] * 3)
    assert "out of reach of [1e-06, 1e-06, 1e-06] N; more thrust or a closer start would do" in warning
