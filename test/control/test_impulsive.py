"""Impulses in closed form against the motion they are for, and the law that flies them under J2."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.impulse_plan import (
    cross_track_impulse,
    in_plane_impulses,
    least_across,
    least_in_plane,
)
from formation_gnc.control.optimal_burns import least_burns
from formation_gnc.errors import DesignError
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.orbit.elements import Elements, state_from_elements, true_from_mean_anomaly
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.parameters import load
from formation_gnc.records import NavigationState
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.registry import MODELS
from formation_gnc.relative.relative_elements import (
    hill_matrix,
    mean_relative_elements,
    near_circular_elements,
    near_circular_matrix,
    state_from_mean,
)
from formation_gnc.types import NANOSECONDS

N = 1.1e-3
HORIZON = 3.0 * math.pi
errors = st.tuples(*[st.floats(-1e3, 1e3)] * 6).map(np.array)
NO_THRUST = np.zeros(3)
TICK = 10.0

TERRASAR = Elements(
    6886536.686,
    0.0001264,
    math.radians(97.4453),
    math.radians(351.0108),
    math.radians(101.2452),
    true_from_mean_anomaly(math.radians(11.652), 0.0001264),
)


@given(errors, st.sampled_from([HORIZON, 5.0 * math.pi, 10.0 * math.pi]))
def test_the_impulses_null_the_elements(elements, horizon):
    elements = elements * [0.1, 1.0, 1.0, 1.0, 1.0, 1.0]
    state, now, model = near_circular_matrix(0.0, N) @ elements, 0.0, HillModel(N)
    burns = [(angle, 4, dv) for angle, dv in in_plane_impulses(elements, N, horizon).tolist()]
    burns += [(angle, 5, dv) for angle, dv in cross_track_impulse(elements, N).tolist()]
    for angle, place, dv in sorted(burns):
        assert 0.0 <= angle <= horizon
        state = model.transition(0.0, (angle - now) / N) @ state
        state[place] += dv
        now = angle
    left = near_circular_elements(0.0, N, model.transition(0.0, (horizon - now) / N) @ state)
    np.testing.assert_allclose(left, 0.0, atol=1e-8 * max(1.0, np.abs(elements).max()))


@given(errors)
def test_no_plan_is_below_the_bound(elements):
    plan = in_plane_impulses(elements, N, HORIZON)
    assert np.abs(plan[:, 1]).sum() >= least_in_plane(elements, N, HORIZON) * (1.0 - 1e-9)
    assert np.abs(cross_track_impulse(elements, N)[0, 1]) == pytest.approx(least_across(elements, N), rel=1e-9)


@given(st.floats(-3.0, 3.0), st.floats(-1.0, 1.0))
def test_a_change_of_eccentricity_vector_reaches_the_bound(angle, share):
    """With at most as much of da, and dlambda free: half of n times the vector."""
    elements = 100.0 * np.array([share, 0.0, math.cos(angle), math.sin(angle), 0.0, 0.0])
    first = in_plane_impulses(elements, N, HORIZON)[0, 0]
    half = (
        0.25 * N * (elements[0] + 100.0 * math.cos(angle - first)),
        0.25 * N * (elements[0] - 100.0 * math.cos(angle - first)),
    )
    elements[1] = 3.0 / N * (half[0] * first + half[1] * (first + math.pi))  # what the two leave nothing of
    plan = in_plane_impulses(elements, N, HORIZON)
    assert np.abs(plan[:, 1]).sum() == pytest.approx(50.0 * N, rel=1e-6)


def test_a_longer_horizon_is_never_dearer():
    elements = np.array([20.0, -500.0, 30.0, 40.0, 0.0, 0.0])
    spent = [np.abs(in_plane_impulses(elements, N, turns * math.tau)[:, 1]).sum() for turns in (1.5, 2.0, 3.0, 5.0)]
    assert spent == sorted(spent, reverse=True)


def manager(**values: Any) -> ControllerManager:
    given = {name.replace("__", "."): value for name, value in values.items()}
    common = {f"chief.{name}": value for name, value in vars(TERRASAR).items()} | {"tick": TICK}
    return ControllerManager("c", load(ControllerParameters, common | {"algorithm": "impulsive"} | given))


def fly(start, goal, law, revolutions, orbit=TERRASAR):
    """Delta-v per axis (m/s), and the final mean elements of deputy and target, under J2 with perfect knowledge."""
    chief, mass, tick = state_from_elements(orbit), 1340.0, 30.0
    deputy = inertial_from_relative(chief, state_from_mean(chief, np.array(start)))
    names = ("da", "dlambda", "dex", "dey", "dix", "diy")
    values = {f"chief.{name}": value for name, value in vars(orbit).items()} | {"tick": tick}
    values |= {f"relative_elements.{name}": value for name, value in zip(names, goal, strict=True)}
    values |= {"formation": "relative_elements", "model": "relative_elements"}
    guidance, spent = Guidance("/deputy1/guidance", load(GuidanceParameters, values)), np.zeros(3)
    for k in range(round(revolutions * orbit.period / tick)):
        estimate = NavigationState(round(k * tick * NANOSECONDS), relative_from_inertial(chief, deputy), chief, mass)
        target, _ = guidance.on_tick(estimate)
        thrust, status = law.on_tick(estimate, target)
        assert not status.fallback
        push = hill_rotation(chief).T @ thrust.force / mass
        spent += np.abs(thrust.force) / mass * tick
        chief = propagate_with_transition(chief, NO_THRUST, tick, 2)[0]
        deputy = propagate_with_transition(deputy, push, tick, 2)[0]
    end = (k + 1) * tick
    path = guidance.configuration.design.anchored(chief, end)
    states = relative_from_inertial(chief, deputy), path.states(np.array([end]))[0]
    return spent, *(mean_relative_elements(chief, each) for each in states)


def test_a_change_of_inclination_vector_takes_the_bound_under_j2():
    law = manager(tick=30.0, thrust_limit=(1.0, 1.0, 1.0), mass=1340.0, impulsive__tolerance=0.5)
    spent, found, wanted = fly([0, 0, 0, 300.0, 0, 400.0], [0, 0, 0, 300.0, 0, 500.0], law, 1.2)
    assert spent.sum() == pytest.approx(TERRASAR.mean_motion * 100.0, rel=0.01)
    assert np.abs(found - wanted).max() < 1.0


def test_a_change_of_every_element_is_flown_near_its_plan_under_j2():
    law = manager(tick=30.0, thrust_limit=(1.0, 1.0, 1.0), mass=1340.0, impulsive__tolerance=0.5)
    start, goal = np.array([0, 300.0, 0, 300.0, 0, 400.0]), np.array([0, 0.0, 100.0, 250.0, 50.0, 450.0])
    spent, found, wanted = fly(start, goal, law, 3.5)
    error, n = start - goal, TERRASAR.mean_motion
    least = least_in_plane(error, n, 1.5 * math.tau) + least_across(error, n)
    # the turn of the elements by the time of the burns, and the closing burns
    assert least * 0.98 < spent.sum() < 1.25 * least
    assert np.abs(found - wanted).max() < 1.0


def test_no_burn_within_the_tolerance(estimate, target):
    law = manager(impulsive__tolerance=50.0)
    for time in np.arange(0.0, 6000.0, 10.0):
        thrust, status = law.on_tick(estimate([5.0, -8.0, 3.0, 0.0, 0.0, 0.0], time), target(time=time))
        assert not thrust.force.any()
        assert status.solver == "coasting"


def test_a_burn_under_way_ends_with_a_jump_of_the_target(estimate, target):
    law, chief = manager(), state_from_elements(TERRASAR)
    far = np.array([50.0, -80.0, 0.0, 0.0, 0.0, 0.0])
    first, status = law.on_tick(estimate(far, chief=chief), target())
    assert first.force.any()
    assert status.solver.startswith("burn along the track: plan of ")
    after, _ = law.on_tick(estimate(far, 10.0, chief=chief), target(far, 10.0))
    assert not after.force.any()


def test_no_burn_is_below_the_least_impulse(estimate, target):
    law, model = manager(impulsive__minimum_impulse=0.02), HillModel(TERRASAR.mean_motion)
    state, forces = np.array([5.0, -8.0, 2.0, 0.0, 0.0, 0.0]), []
    for time in np.arange(0.0, 18000.0, 10.0):
        thrust, _ = law.on_tick(estimate(state, time, chief=state_from_elements(TERRASAR)), target(time=time))
        forces.append(thrust.force)
        state = model.propagate(0.0, state, 10.0, thrust.force / 100.0)
    along = np.abs(np.array(forces)[:, 1:])
    assert along.any()
    assert (along[along > 1e-4] * 10.0 >= 0.0199).all()  # turned by half a tick, cos 0.005


def test_the_least_burns_null_the_error_and_reach_their_bound():
    rng = np.random.default_rng(3)
    for eccentricity, name in ((0.0, "hill"), (0.4, "tschauner_hempel"), (0.7, "relative_elements")):
        model = MODELS[name].about(Elements(7e6 / (1.0 - eccentricity), eccentricity, 1.0, 0.3, 0.4, 0.5))
        error = rng.uniform(-100.0, 100.0, 6) * np.repeat([1.0, math.tau / model.period], 3)
        plan = least_burns(model, 0.0, error, 1.5 * model.period, np.ones(3))
        state, now = error, 0.0
        for when, impulse in zip(plan.times, plan.impulses, strict=True):
            state = model.transition(now, when - now) @ state + np.concatenate([np.zeros(3), impulse])
            now = when
        left = model.transition(now, 1.5 * model.period - now) @ state
        assert np.abs(left[:3]).max() < 0.05  # by impulses a five-hundredth of a revolution apart taken as one
        assert plan.least <= plan.delta_v * (1.0 + 1e-9)
        assert plan.delta_v == pytest.approx(plan.least, rel=1e-3)  # the price of late burns


@given(errors)
@settings(max_examples=10, deadline=None)
def test_the_least_burns_are_no_dearer_than_the_closed_form(elements):
    """Radial thrust and times of their own can only save."""
    elements = elements * [0.1, 1.0, 1.0, 1.0, 1.0, 1.0]
    assume(np.abs(elements).max() > 1.0)
    closed = np.abs(in_plane_impulses(elements, N, HORIZON)[:, 1]).sum()
    closed += np.abs(cross_track_impulse(elements, N)[0, 1])
    error = near_circular_matrix(0.0, N) @ elements
    plan = least_burns(HillModel(N), 0.0, error, HORIZON / N, np.ones(3))
    assert plan.least <= closed * (1.0 + 1e-6)
    assert plan.delta_v <= closed * (1.0 + 2e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("eccentricity", [0.05, 0.5])
def test_an_eccentric_formation_is_flown_near_the_least(eccentricity):
    """Under J2 from 300 m off with perfect knowledge: within 5 % of the bound of the first plan, to a metre."""
    orbit = Elements(7e6 / (1.0 - eccentricity), eccentricity, 1.0, 0.3, 0.4, 2.0)
    start, goal = [0.0, 300.0, 50.0, 100.0, -60.0, 80.0], [0.0, 0.0, 100.0, 150.0, 0.0, 100.0]
    chief = {f"chief__{name}": value for name, value in vars(orbit).items()}
    law = manager(tick=30.0, thrust_limit=(1.0, 1.0, 1.0), mass=1340.0, impulsive__tolerance=0.5, **chief)
    spent, found, wanted = fly(start, goal, law, 3.2, orbit)  # two horizons, and the last burn
    model = MODELS["relative_elements"].about(orbit)
    error = hill_matrix(model.elements) @ (np.array(start) - goal)
    least = least_burns(model, 0.0, error, 1.5 * model.period, np.ones(3)).least
    assert 0.97 * least < spent.sum() < 1.1 * least
    assert np.abs(found - wanted).max() < 2.0


def test_of_like_burns_the_first_is_taken():
    """Across the track every node is as good: the burn is within the first revolution of three, planned anywhere."""
    model = MODELS["tschauner_hempel"].about(Elements(1.1e7, 0.4, 1.0, 0.3, 0.4, 0.5))
    for share in np.arange(5) / 5.0:
        now = share * model.period
        error = model.transition(0.0, now) @ np.array([0.0, 0.0, 100.0, 0.0, 0.0, 0.05])
        plan = least_burns(model, now, error, 3.0 * model.period, np.ones(3))
        assert plan.times.max() < model.period


def test_no_burn_is_put_off_beyond_its_deadline():
    """At e = 0.4 and i = 10 deg J2 makes a later burn across the track cheaper, but not by a tenth."""
    model = MODELS["relative_elements"].about(Elements(1.1e7, 0.4, 0.17453, 0.0, 1.2217, 0.0))
    error = np.array([0.0, 0.0, 500.0, 0.0, 0.0, 0.3])
    plans = [
        least_burns(model, 0.0, error, 3.0 * model.period, np.ones(3), deadline)
        for deadline in (math.inf, 1.5 * model.period)
    ]
    large = np.abs(plans[1].impulses).max(axis=1) > 1e-3 * plans[1].delta_v
    assert plans[1].times[large].max() <= 1.5 * model.period
    assert plans[0].delta_v <= plans[1].delta_v <= 1.1 * plans[0].delta_v


def test_no_thrust_along_the_track_is_rejected_by_name():
    with pytest.raises(DesignError, match=r"impulsive: thrust_limit along the track is 0 N"):
        manager(chief__eccentricity=0.3, chief__semi_major_axis=1e7, thrust_limit=(1.0, 0.0, 1.0))
