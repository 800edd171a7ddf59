"""The way out of a fault: against propagation in other forces, from states that the estimate may be off to."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import NO_NEIGHBOURS, Estimate
from formation_gnc.relative.hill import HillModel
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.passive_safety import elements, least_separation, manoeuvre
from formation_gnc.supervision.safe import HORIZON, NO_FORCE, RISK, Coast, Situation, WayOut, plan_evasion, way_out
from formation_gnc.types import NANOSECONDS

from .test_monitors import ORBIT

LIMIT = 10.0
CHIEF = state_from_elements(Elements(6978100.0, 0.0, 1.7, 0.0, 0.0, 0.0))
COVARIANCE = np.diag([0.32, 0.59, 0.21, 2.8e-7, 9.9e-7, 2.7e-7])  # that of a leader-follower after half an hour
COVARIANCE[0, 4] = COVARIANCE[4, 0] = -5.6e-4 * 0.95


def situation(y: float = -100.0, **changes: Any) -> Situation:
    given = Situation(
        CHIEF, np.array([0.0, y, 0.0, 0.0, 0.0, 0.0]), COVARIANCE, np.zeros((1, 6)), LIMIT, np.full(3, 1e-4)
    )
    return replace(given, **changes)


def flown(given: Situation, way: WayOut, relative: np.ndarray, hours: float = 24.0) -> float:
    """Least true distance (m) with zonal harmonics to degree six, of a satellite that is where the estimate is not."""
    step = 120.0
    propagator = Propagator(step, 1, Forces(zonal_degree=6))
    others = [inertial_from_relative(given.chief, each) for each in given.others]
    states = np.vstack([given.chief, others, inertial_from_relative(given.chief, relative)])
    least = np.inf
    for tick in range(round(hours * 3600.0 / step)):
        acceleration = sum(
            (np.array(each.acceleration) for each in way.burns if each.begin <= (tick + 0.5) * step < each.end),
            np.zeros(3),
        )
        thrust = np.zeros((len(states), 3))
        thrust[-1] = acceleration @ hill_rotation(states[0])
        states = propagator.propagate(0.0, states, thrust, np.ones(len(states)))
        least = min(least, np.linalg.norm(states[1:-1, :3] - states[-1, :3], axis=1).min())
    return float(least)


def test_a_day_of_coasting_is_above_the_limit_wherever_the_state_is() -> None:
    """100 m behind, within its uncertainty: coasting may come too close, the way out never does."""
    given, random = situation(), np.random.default_rng(1)
    way = way_out(given)
    assert way.burns
    assert way.coasting.risk > 0.05
    assert way.outcome.risk <= RISK
    states = random.multivariate_normal(given.relative, COVARIANCE, 6)
    assert min(flown(given, way, each) for each in states) > LIMIT


def test_the_forecast_is_the_true_separation() -> None:
    """Within a metre and 3 % of the distance: higher harmonics, and a least distance between the points."""
    for given in (situation(), situation(-3000.0)):
        way = way_out(given)
        assert flown(given, way, given.relative) == pytest.approx(way.outcome.separation, rel=0.03, abs=1.0)


def test_a_safe_orbit_is_left_alone() -> None:
    n = HillModel(1.083e-3).mean_motion
    circle = np.array([-50.0, 0.0, 0.0, 0.0, 100.0 * n, 50.0 * n])  # parallel vectors of 50 m, without drift
    assert least_separation(elements(circle, n)) == pytest.approx(50.0, rel=1e-9)
    assert way_out(situation(relative=circle, covariance=0.01 * COVARIANCE)).burns == ()
    assert way_out(situation(-2.2e5)).burns == ()


def test_perpendicular_vectors_have_no_separation_across_the_track() -> None:
    n = 1e-3
    assert least_separation(elements(np.array([-50.0, 0.0, 50.0, 0.0, 100.0 * n, 0.0]), n)) == pytest.approx(
        0.0, abs=1e-5
    )


@pytest.mark.parametrize("broken", range(3))
def test_what_does_not_work_is_not_used(broken: int) -> None:
    limit = np.full(3, 1e-4)
    limit[broken] = 0.0
    way = way_out(situation(acceleration=limit))
    assert way.burns
    assert all(each.acceleration[broken] == 0.0 for each in way.burns)
    assert way.outcome.risk <= RISK
    assert flown(situation(), way, situation().relative) > LIMIT


def test_without_thrust_it_coasts_and_says_so() -> None:
    way = way_out(situation(acceleration=np.zeros(3)))
    assert way.burns == ()
    assert "coasts, since no manoeuvre lowers the risk" in way.words


def test_the_manoeuvre_has_the_least_delta_v_that_theory_allows() -> None:
    """In plane half the rate times the change of the vector, by two tangential burns; across, the rate times it."""
    n = 1e-3
    in_plane = manoeuvre(np.array([0.0, 3.0, 4.0, 0.0, 0.0]), np.full(3, 1.0), n)
    across = manoeuvre(np.array([0.0, 0.0, 0.0, 3.0, 4.0]), np.full(3, 1.0), n)
    for burns, bound in ((in_plane, 0.5 * n * 5.0), (across, n * 5.0)):
        assert burns is not None
        # Segments of 15 degrees: held thrust loses 0.3 %, and the best angle is up to half of one off: 0.9 %.
        assert bound <= sum(each.delta_v for each in burns) <= 1.02 * bound


def test_an_untrusted_state_is_not_steered_by_but_retreated_from() -> None:
    """The side of the chief is certain: thrust along the track alone. Between two satellites none is, and it coasts."""
    retreat = way_out(situation(is_trusted=False))
    assert retreat.burns
    assert all(each.acceleration[0] == each.acceleration[2] == 0.0 for each in retreat.burns)
    assert retreat.outcome.risk < retreat.coasting.risk
    assert "retreats along the track" in retreat.words
    between = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, -200.0, 0.0, 0.0, 0.0, 0.0]])
    stay = way_out(situation(is_trusted=False, others=between))
    assert stay.burns == ()
    assert "no direction is certain" in stay.words


def test_a_way_out_is_safe_whichever_side_thrust_is_to() -> None:
    """Thrust that may be to the other side: the risk is that of the worse one, and both end above the limit."""
    given = situation(relative=np.array([2.0, -100.0, 3.0, 0.002, -0.004, 0.0]))
    way = way_out(replace(given, thrust=((1.0, 1.0, 1.0), (-1.0, -1.0, -1.0))))
    assert way.burns
    assert way.coasting.risk > 0.05
    assert way.outcome.risk <= RISK
    assert way.delta_v > way_out(given).delta_v
    opposite = [
        replace(each, acceleration=(-each.acceleration[0], -each.acceleration[1], -each.acceleration[2]))
        for each in way.burns
    ]
    assert flown(given, way, given.relative) > LIMIT
    assert flown(given, replace(way, burns=opposite), given.relative) > LIMIT


def test_an_encounter_within_a_revolution_is_avoided_at_once() -> None:
    """Drifting towards the chief at 80 m a revolution from 100 m behind, 8.5 m below: two hours to the encounter."""
    n = float(np.sqrt(3.986004418e14 / 6978100.0**3))
    drift = np.array([-80.0 / (3.0 * np.pi), -100.0, 0.0, 0.0, 1.5 * n * 80.0 / (3.0 * np.pi), 0.0])
    given = situation(relative=drift)
    way = way_out(given, horizon=11600.0, urgent=True)
    assert flown(given, way_out(replace(given, acceleration=np.zeros(3))), drift, 3.2) < LIMIT
    assert way.outcome.risk <= RISK
    assert flown(given, way, drift, 3.2) > LIMIT


def test_others_of_a_fleet_are_kept_away_from_as_well() -> None:
    others = np.array([[0.0, y, 0.0, 0.0, 0.0, 0.0] for y in (0.0, -200.0, 100.0)])
    given = situation(others=others)
    way = way_out(given)
    assert way.outcome.risk <= RISK
    assert flown(given, way, given.relative) > LIMIT


def test_a_plan_is_flown_tick_by_tick_and_ends_in_coasting() -> None:
    parameters = SupervisorParameters(chief=ORBIT, tick=1.0)
    estimate = Estimate(0, situation().relative, CHIEF, 100.0, COVARIANCE, False, [], 0.0, 0)
    plan = plan_evasion(Mode.SAFE, 0, estimate, parameters, NO_NEIGHBOURS, ("x",))
    forces = np.array([plan.force(tick * NANOSECONDS) for tick in range(0, 20000, 10)])
    assert forces[:, 1:].any()
    assert not forces[:, 0].any()
    assert np.abs(forces).max() <= 0.01 + 1e-12
    assert plan.force(round(HORIZON) * NANOSECONDS) is NO_FORCE
    assert isinstance(plan_evasion(Mode.SAFE, 0, None, parameters), Coast)
    lost = replace(estimate, covariance=np.full((6, 6), np.nan))
    assert not plan_evasion(Mode.AVOID, 0, lost, parameters).force(0).any()
