"""What laws share that fly a reconfiguration in a given time, with a planner that answers as it is told."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.control.controller import Handover, Vehicle
from formation_gnc.control.finite_horizon import (
    MOST_STEPS,
    FiniteHorizonController,
    FiniteHorizonParameters,
    Plan,
    Task,
    leaps,
    target_after,
)
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import DesignError
from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.types import NANOSECONDS

CHIEF = state_from_elements(Elements(6978100.0, 0.0, 1.48, 0.0, 0.0, 0.0))
FINITE_HORIZONS = [law for law in ALGORITHMS.values() if issubclass(law, FiniteHorizonController)]
PARAMETERS = FiniteHorizonParameters(final_time=1000.0, step=50.0, replan_interval=200.0, last_plan=300.0)


class Told(FiniteHorizonController):
    """Plans half the thrust limit along x, or what it is told."""

    def __init__(self, common, vehicle, answer=None, **changes):
        super().__init__(dataclasses.replace(PARAMETERS, **changes), common, vehicle)
        self.answer, self.tasks = answer, []

    def plan(self, task: Task) -> Plan:
        self.tasks.append(task)
        if isinstance(self.answer, Exception):
            raise self.answer
        if self.answer is not None:
            return Plan(np.tile(self.answer, (task.steps, 1)), task.duration)
        return Plan(np.tile([5e-5, 0.0, 0.0], (task.steps, 1)), task.duration, 3)


def fly(law, estimate, target, ticks, begin=0, tick=10.0, goal=lambda time: np.zeros(6)):
    return [
        law.command(
            estimate([5.0, 0, 0, 0, 0, 0], index * tick, chief=CHIEF),
            target(goal(index * tick), time=index * tick),
        )
        for index in range(begin, begin + ticks)
    ]


def test_it_plans_on_schedule_until_the_last_plan_and_then_holds(common, vehicle, estimate, target):
    law = Told(common, vehicle)
    commands = fly(law, estimate, target, 110)
    planned = [index for index, command in enumerate(commands) if command.solver == "planned"]
    assert planned == [0, 20, 40, 60]  # at 800 s, 200 s are to go: less than last_plan
    assert [task.duration for task in law.tasks] == pytest.approx([1000.0, 800.0, 600.0, 400.0])
    assert [task.steps for task in law.tasks] == [20, 16, 12, 8]
    assert {command.solver for command in commands[100:]} == {"holding"}
    assert commands[99].solver == "following"
    assert not any(command.fallback for command in commands)
    np.testing.assert_allclose([command.force for command in commands[:100]], [[0.005, 0, 0]] * 100)
    held = law.holding.command(estimate([5.0, 0, 0, 0, 0, 0]), target())
    np.testing.assert_array_equal(commands[105].force, held.force)


def test_what_is_left_of_a_plan_is_the_guess_for_the_next(common, vehicle, estimate, target):
    law = Told(common, vehicle)
    fly(law, estimate, target, 21)
    assert law.tasks[0].guess is None
    np.testing.assert_allclose(law.tasks[1].guess, [[5e-5, 0, 0]] * 16, atol=1e-18)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (np.full(3, np.nan), "not finite"),
        (np.array([2e-4, 0, 0]), "final_time is too short: 2 times the thrust limit"),
        (np.linalg.LinAlgError("Singular matrix"), "Singular matrix"),
        (ZeroDivisionError("by zero"), "by zero"),
    ],
)
def test_a_plan_that_does_not_count_is_named_and_another_law_flies(answer, words, common, vehicle, estimate, target):
    law = Told(common, vehicle, answer)
    (command,) = fly(law, estimate, target, 1)
    assert words in command.fallback
    assert command.fallback.endswith("LQR flies")
    held = law.holding.command(estimate([5.0, 0, 0, 0, 0, 0]), target())
    np.testing.assert_array_equal(command.force, held.force)
    law.answer = None
    commands = fly(law, estimate, target, 25, 1)
    assert commands[18].fallback
    assert not commands[19].fallback  # at the next time on the schedule
    law.answer = answer
    commands = fly(law, estimate, target, 25, 26)
    assert words in commands[-1].fallback
    assert commands[-1].fallback.endswith("the plan before flies on")
    np.testing.assert_allclose(commands[-1].force, [0.005, 0, 0])


@pytest.mark.parametrize("before", FINITE_HORIZONS)
@pytest.mark.parametrize("after", FINITE_HORIZONS)
def test_a_swap_begins_a_reconfiguration_and_new_parameters_go_on(before, after, common, vehicle, estimate, target):
    old, new = (law(law.Parameters(final_time=500.0, step=50.0), common, vehicle) for law in (before, after))
    seen = estimate([1.0, 0, 0, 0, 0, 0], chief=CHIEF)
    assert old.command(seen, target()).solver == "planned"
    new.activate(Handover(np.zeros(3), "before", old))
    later = dataclasses.replace(seen, time=10 * NANOSECONDS)
    assert new.command(later, target(time=10.0)).solver == ("following" if before is after else "planned")


def test_a_chief_on_no_orbit_is_named(common, vehicle, estimate, target):
    command = Told(common, vehicle).command(estimate(np.ones(6)), target())
    assert "no plan" in command.fallback
    assert np.isfinite(command.force).all()


def test_a_leap_of_the_target_begins_anew_and_a_smooth_path_does_not(common, vehicle, estimate, target):
    law = Told(common, vehicle)
    n = common.mean_motion
    small, large = (RelativeOrbit(RelativeOrbitParameters(rho=rho, m=1.0), n) for rho in (1000.0, 1010.0))

    def path(time):
        return (small if time < 600.0 else large).states(np.array([time]))[0]

    commands = fly(law, estimate, target, 180, goal=path)
    begun = [index for index, task in enumerate(law.tasks) if task.duration == 1000.0]
    assert len(begun) == 2
    assert commands[60].solver == "planned"
    assert commands[159].solver == "following"
    assert commands[160].solver == "holding"


@given(
    rho=st.floats(1.0, 1e5),
    m=st.floats(-2, 2),
    tick=st.floats(0.1, 60.0),
    theta=st.floats(0.0, 6.3),
    step=st.floats(1.0, 1e4),
)
def test_free_orbits_of_any_size_do_not_leap_and_steps_between_them_do(rho, m, tick, theta, step, target):
    n = 1.1e-3
    near = RelativeOrbit(RelativeOrbitParameters(rho=rho, m=m, theta=theta), n).states(np.array([0.0, tick]))
    far = RelativeOrbit(RelativeOrbitParameters(rho=rho, m=m, theta=theta, b=step), n).states(np.array([tick]))
    assert not leaps(target(near[0]), target(near[1], tick))
    if step > 1.0 + 0.05 * np.linalg.norm(near[1] - near[0]):
        assert leaps(target(near[0]), target(far[0], tick))


def test_a_change_of_parameters_goes_on_and_a_final_time_that_is_past_is_named(common, vehicle, estimate, target):
    law, other = Told(common, vehicle), Told(common, vehicle, final_time=400.0)
    fly(law, estimate, target, 50)
    other.activate(Handover(np.zeros(3), "told", law))
    (command,) = fly(other, estimate, target, 1, 50)
    assert command.fallback == "final_time is past by 100 s; LQR flies"
    longer = Told(common, vehicle, final_time=2000.0)
    longer.activate(Handover(np.zeros(3), "told", law))
    fly(longer, estimate, target, 20, 51)
    assert longer.tasks[0].duration == pytest.approx(1400.0)  # counted from the begin


def test_the_goal_is_the_preview_and_free_flight_from_its_end(common, target):
    """On an orbit so small that Hill's equations are the exact ones."""
    orbit = RelativeOrbit(RelativeOrbitParameters(rho=1.0, m=1.0), common.mean_motion)
    model = NonlinearModel(KeplerChief(common.chief.semi_major_axis))
    times = 60.0 * np.arange(11)
    states = orbit.states(times)
    aim = target(states[0], preview=states[1:], step=60.0)
    for ahead in (0.0, 1.0, 100.0, 599.0, 600.0, 5000.0):
        # the cubic's error is (n h)^4 / 384 of 2 m, in position, and (n h)^3 / 72 in velocity; the drift of
        # second order is some 30 times (1 m)^2 over the radius in a revolution
        expected = orbit.states(np.array([ahead]))[0]
        np.testing.assert_allclose(target_after(aim, ahead, model)[:3], expected[:3], rtol=0, atol=1e-5)
        np.testing.assert_allclose(target_after(aim, ahead, model)[3:], expected[3:], rtol=0, atol=2e-8)
    np.testing.assert_allclose(
        target_after(target(states[0]), 3000.0, model), orbit.states(np.array([3000.0]))[0], atol=1e-5
    )


@settings(deadline=None)
@given(
    forces=st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=1, max_size=20),
    cuts=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=5),
)
def test_the_mean_of_a_plan_keeps_its_impulse_however_it_is_cut(forces, cuts):
    plan = Plan(np.array(forces), 100.0)
    edges = np.unique(np.concatenate([[0.0, 100.0], 100.0 * np.array(cuts)]))
    edges = edges[np.append(True, np.diff(edges) > 1e-6)]
    impulse = plan.mean(edges[:-1], edges[1:]) * np.diff(edges)[:, None]
    total = plan.acceleration.sum(axis=0) * 100.0 / len(forces)
    np.testing.assert_allclose(impulse.sum(axis=0), total, atol=1e-4)


def test_a_plan_of_too_many_steps_is_rejected(common, vehicle):
    with pytest.raises(DesignError, match=f"at most {MOST_STEPS} steps"):
        Told(common, vehicle, step=0.1)


def test_an_axis_without_thrust_is_no_obstacle_unless_the_plan_uses_it(common, estimate, target):
    vehicle = Vehicle(100.0, np.array([0.01, 0.0, 0.01]))
    (command,) = fly(Told(common, vehicle), estimate, target, 1)
    assert command.solver == "planned"
    (command,) = fly(Told(common, vehicle, np.array([0.0, 1e-5, 0.0])), estimate, target, 1)
    assert "too short" in command.fallback
