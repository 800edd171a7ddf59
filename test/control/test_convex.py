"""Finite-thrust plans by cone programmes: against the least possible, and within their constraints."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from formation_gnc.control.cone_programme import ConeError, ConeProgramme
from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.models import CLOSED_FORM_MODELS
from formation_gnc.control.path_constraints import turned
from formation_gnc.control.thrust_response import ThrustResponse
from formation_gnc.errors import DesignError
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.parameters import load
from formation_gnc.relative.hill import HillModel

MASS, TICK = 100.0, 10.0
START, GOAL = np.array([0.0, -300.0, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 200.0, 0.0, 0.0, 0.0, 0.0])


def manager(**values: Any) -> ControllerManager:
    given = {name.replace("__", "."): value for name, value in values.items()}
    basis = {"chief.semi_major_axis": 6978100.0, "chief.inclination": 1.48, "tick": TICK, "algorithm": "convex"}
    return ControllerManager("c", load(ControllerParameters, basis | {"thrust_limit": (0.1,) * 3} | given))


def fly(law, start, goal, estimate, target, ticks=600, **more):
    """Forces (N, 3), states (N + 1, 6) and the words of the solver on Hill's equations; no fallback.

    The plant holds a force in inertial axes: in the turning ones it has turned back by half of a tick's angle.
    """
    model, states, forces, words = HillModel(law.parameters.mean_motion), [np.array(start)], [], []
    chief, half = state_from_elements(law.parameters.chief_elements), 0.5 * TICK * law.parameters.mean_motion
    turn = np.array([[math.cos(half), math.sin(half), 0.0], [-math.sin(half), math.cos(half), 0.0], [0.0, 0.0, 1.0]])
    for tick in range(ticks):
        aim = target(model.propagate(0.0, goal, TICK * tick), TICK * tick, **more)
        thrust, status = law.on_tick(estimate(states[-1], TICK * tick, MASS, chief), aim)
        assert not status.fallback
        forces.append(thrust.force)
        words.append(status.solver)
        states.append(model.propagate(0.0, states[-1], TICK, turn @ thrust.force / MASS))
    return np.array(forces), np.array(states), words


def spent(forces):
    return float(np.abs(forces).sum()) / MASS * TICK


@pytest.mark.parametrize("name", sorted(CLOSED_FORM_MODELS))
def test_the_response_is_that_of_the_model(name, common):
    model, rng = CLOSED_FORM_MODELS[name](common), np.random.default_rng(1)
    accelerations, state = 1e-4 * rng.standard_normal((8, 3)), np.array([10.0, 200.0, 30.0, 0.1, 0.2, -0.1])
    response = ThrustResponse.of(model, 50.0, 60.0, 8, 0)
    planned = response.free[-1] @ response.origins(state, accelerations)[-1]
    for step, each in enumerate(accelerations):
        state = model.propagate(50.0 + 60.0 * step, state, 60.0, each)
    # three nodes a step of 0.06 rad: the rest of the quadrature is far below a part in a million
    np.testing.assert_allclose(planned, state, atol=1e-5)


@settings(max_examples=10, deadline=None)
@given(place=st.tuples(*[st.floats(-300.0, 300.0)] * 3))
def test_the_plan_takes_the_least_of_a_linear_programme(place, estimate, target):
    """HiGHS on the same motion and limits, to the target itself; the plan may leave a millimetre."""
    assume(np.linalg.norm(place) > 10.0)
    law, error = manager(convex__tolerance=1e-3), np.array([*place, 0.0, 0.0, 0.0])
    model = HillModel(law.parameters.mean_motion)
    response = ThrustResponse.of(model, 0.0, 60.0, 100, 0)
    unit = np.repeat([1.0, model.mean_motion], 3)
    forced = np.hstack(list(response.pushed * 1e-3)) / unit[:, None]
    least = linprog(np.ones(600), A_eq=np.hstack([forced, -forced]), b_eq=-error / unit, bounds=(0.0, 1.0))
    _, status = law.on_tick(estimate(error, chief=state_from_elements(law.parameters.chief_elements)), target())
    assert float(status.solver.split()[1]) == pytest.approx(least.fun * 1e-3 * 60.0, rel=2e-3)


def test_a_reconfiguration_is_flown_as_planned(estimate, target):
    forces, states, words = fly(manager(), START, GOAL, estimate, target)
    planned = float(words[0].split()[1])
    assert spent(forces) == pytest.approx(planned, rel=0.02)  # and the plans after, of what ticks leave
    end = HillModel(manager().parameters.mean_motion).propagate(0.0, GOAL, 6000.0)
    assert np.linalg.norm((states[-1] - end)[:3]) < 0.5


def test_more_time_is_never_dearer(estimate, target):
    bills = []
    for time in (3000.0, 6000.0, 12000.0):
        forces, _, _ = fly(manager(convex__final_time=time), START, GOAL, estimate, target, round(time / TICK))
        bills.append(spent(forces))
    assert bills == sorted(bills, reverse=True)


def test_the_total_thrust_is_within_its_limit(estimate, target):
    law = manager(convex__total_thrust=0.02)
    forces, _, _ = fly(law, [30.0, -300.0, 100.0, 0.0, 0.0, 0.0], np.zeros(6), estimate, target)
    assert np.linalg.norm(forces, axis=1).max() <= 0.02 * (1.0 + 1e-9)
    assert np.linalg.norm(forces, axis=1).max() > 0.0199


def test_there_is_no_thrust_in_windows_and_eclipses(estimate, target):
    law = manager(convex__no_thrust=(300.0, 900.0), convex__off_in_eclipse=True)
    dark = np.array([[2000.0, 4000.0]])
    forces, _, _ = fly(law, START, GOAL, estimate, target, eclipses=dark)
    pushed = forces.any(axis=1)
    assert pushed.any()
    assert not pushed[30:90].any()
    assert not pushed[200:400].any()


CROSSING = np.array([0.0, -300.0, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 40.0, 0.0, 0.0, 0.0, 0.0])


def test_the_keep_out_sphere_is_flown_around(estimate, target):
    values = {"convex__final_time": 600.0, "convex__step": 20.0, "convex__last_plan": 300.0, "thrust_limit": (1.0,) * 3}
    free, around = (
        fly(manager(**values, convex__keep_out_radius=radius), *CROSSING, estimate, target, 60)
        for radius in (0.0, 35.0)
    )
    nearest = [np.linalg.norm(each[1][:, :3], axis=1).min() for each in (free, around)]
    assert nearest[0] < 30.0
    assert nearest[1] > 34.0  # met at the ends of the steps of 20 s
    assert spent(around[0]) > spent(free[0])


def test_coasting_after_any_burn_stays_outside_for_the_stated_time(estimate, target):
    values = {"convex__final_time": 900.0, "convex__keep_out_radius": 55.0, "convex__replan_interval": 1e4}
    values |= {"convex__step": 30.0, "thrust_limit": (1.0,) * 3}
    start, goal = np.array([0.0, -400.0, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, -60.0, 0.0, 0.0, 0.0, 0.0])
    model, nearest = HillModel(manager().parameters.mean_motion), []
    for safe in (0.0, 1500.0):
        _, states, _ = fly(manager(**values, convex__safe_time=safe), start, goal, estimate, target, 90)
        coasts = [model.transitions(0.0, 30.0 * np.arange(51))[:, :3] @ state for state in states[3::3]]
        nearest.append(float(np.linalg.norm(coasts, axis=2).min()))
    assert nearest[0] < 50.0
    assert nearest[1] > 54.0


def test_the_approach_is_within_its_cone_and_speed(estimate, target):
    axis, slope = np.array([0.0, -1.0, 0.0]), math.tan(0.3)
    values = {"convex__cone_half_angle": 0.3, "convex__speed_limit": 0.05, "convex__total_thrust": 0.1}
    goal = np.array([0.0, -5.0, 0.0, 0.0, 0.0, 0.0])
    _, states, _ = fly(manager(**values), [-50.0, -300.0, 20.0, 0.0, 0.0, 0.0], goal, estimate, target)
    near = states[np.linalg.norm(states[:, :3], axis=1) < 99.0]
    ahead = near[:, :3] @ axis
    assert len(near) > 10
    assert (np.linalg.norm(near[:, :3] - np.outer(ahead, axis), axis=1) <= slope * ahead + 1.0).all()
    assert np.linalg.norm(near[:, 3:], axis=1).max() < 0.05 * 1.1  # between steps


def test_an_impossible_path_is_a_fallback_without_thrust(estimate, target):
    law = manager(convex__keep_out_radius=100.0)
    chief = state_from_elements(law.parameters.chief_elements)
    thrust, status = law.on_tick(estimate([0.0, -5.0, 0.0, 0.0, 0.0, 0.0], chief=chief), target(GOAL))
    assert not thrust.force.any()
    assert "Infeasible; no plan: no thrust" in status.fallback


def test_a_target_out_of_reach_is_neared(estimate, target):
    law = manager(thrust_limit=(1e-4,) * 3)
    chief = state_from_elements(law.parameters.chief_elements)
    thrust, status = law.on_tick(estimate(START, chief=chief), target(GOAL))
    assert thrust.force.any()
    assert not status.fallback
    assert float(status.solver.split()[-2]) > 100.0


def test_the_previous_plan_continues_without_a_new_one(estimate, target):
    law = manager(convex__replan_interval=0.0)
    chief = state_from_elements(law.parameters.chief_elements)
    law.on_tick(estimate(START, chief=chief), target(GOAL))
    _, status = law.on_tick(estimate([1e10, 0.0, 0.0, 0.0, 0.0, 0.0], 10.0, chief=chief), target(GOAL, 10.0))
    assert status.fallback == "convex: error out of range; previous plan continues"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"step": 15.0}, "step is 15 s; it must be a whole number of ticks of 10 s"),
        ({"final_time": 1e6}, "final_time is 16666.7 steps; it must be 1 to 5000"),
        ({"no_thrust": (5.0,)}, "no_thrust must be pairs"),
        ({"no_thrust": (5.0, 5.0)}, "no_thrust must be pairs"),
        ({"cone_half_angle": 0.5, "cone_axis": (0.0, 0.0, 0.0)}, "cone_axis must not be zero"),
    ],
)
def test_what_admits_no_plan_is_rejected_by_name(values, message):
    with pytest.raises(DesignError, match=message):
        manager(**{f"convex__{name}": value for name, value in values.items()})


def test_a_programme_without_thrust_or_solution_is_an_error():
    nothing = (np.zeros((1, 6)), np.zeros(1)), (np.zeros((1, 1)), np.zeros(1))
    with pytest.raises(ConeError, match="no thrust allowed"):
        ConeProgramme(np.zeros((2, 3)), 0.0, np.ones(2), 1.0, *nothing).solve()
    beyond = np.ones((1, 6)), np.array([-10.0])
    with pytest.raises(ConeError, match="Infeasible"):
        ConeProgramme(np.ones((2, 3)), 0.0, np.ones(2), 1.0, *nothing, [beyond]).solve()


@pytest.mark.parametrize("last", [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
def test_a_normal_turns_evenly(last):
    normals = turned(np.array([1.0, 0.0, 0.0]), np.array(last), np.linspace(0.0, 1.0, 7))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(normals[-1], last, atol=1e-9)
    angles = np.arccos(np.clip(np.einsum("ki,ki->k", normals[:-1], normals[1:]), -1.0, 1.0))
    np.testing.assert_allclose(angles, angles[0], atol=1e-6)


def test_a_changed_parameter_continues_the_phase(estimate, target):
    law = manager()
    chief = state_from_elements(law.parameters.chief_elements)
    law.on_tick(estimate(START, chief=chief), target(GOAL))
    law.commit(law.stage({"convex.tolerance": 0.2}))
    _, status = law.on_tick(estimate(START, 10.0, chief=chief), target(GOAL, 10.0))
    assert status.solver == "following"
