"""Base of the laws with a final time, with a scripted planner."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Handover, Vehicle
from formation_gnc.control.finite_horizon import MAX_STEPS, FiniteHorizonController, FiniteHorizonParameters
from formation_gnc.control.plan import Plan, Task, held_over_tick
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.control.target_prediction import has_jumped, target_after
from formation_gnc.errors import DesignError
from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.types import NANOSECONDS

CHIEF = state_from_elements(Elements(6978100.0, 0.0, 1.48, 0.0, 0.0, 0.0))
FINITE_HORIZONS = [law for law in ALGORITHMS.values() if issubclass(law, FiniteHorizonController)]
PARAMETERS = FiniteHorizonParameters(final_time=1000.0, step=50.0, replan_interval=200.0, last_plan=300.0)

HELD = 100.0 * held_over_tick(np.array([5e-5, 0.0, 0.0]), CHIEF, 10.0)
"""N; the scripted acceleration as the plant holds it."""


class ScriptedPlanner(FiniteHorizonController[FiniteHorizonParameters]):
    """Plans half the thrust limit along x, or returns a given acceleration, or raises a given error."""

    def __init__(self, common, vehicle, output=None, **changes):
        super().__init__(dataclasses.replace(PARAMETERS, **changes), common, vehicle)
        self.output, self.tasks = output, []

    def plan(self, task: Task) -> Plan:
        self.tasks.append(task)
        if isinstance(self.output, Exception):
            raise self.output
        if self.output is not None:
            return Plan(np.tile(self.output, (task.steps, 1)), task.duration)
        return Plan(np.tile([5e-5, 0.0, 0.0], (task.steps, 1)), task.duration, 3)


def simulate(law, estimate, target, ticks, begin=0, tick=10.0, goal=lambda time: np.zeros(6)):
    return [
        law.command(
            estimate([5.0, 0, 0, 0, 0, 0], index * tick, chief=CHIEF),
            target(goal(index * tick), time=index * tick),
        )
        for index in range(begin, begin + ticks)
    ]


def test_it_plans_on_schedule_until_the_last_plan_then_holds(common, vehicle, estimate, target):
    law = ScriptedPlanner(common, vehicle)
    commands = simulate(law, estimate, target, 110)
    planned = [index for index, command in enumerate(commands) if command.solver == "planned"]
    assert planned == [0, 20, 40, 60]  # at 800 s the time to go is 200 s, less than last_plan
    assert [task.duration for task in law.tasks] == pytest.approx([1000.0, 800.0, 600.0, 400.0])
    assert [task.steps for task in law.tasks] == [20, 16, 12, 8]
    assert {command.solver for command in commands[100:]} == {"holding"}
    assert commands[99].solver == "following"
    assert not any(command.fallback for command in commands)
    np.testing.assert_allclose([command.force for command in commands[:100]], [HELD] * 100)
    held = ScriptedPlanner(common, vehicle).holding.command(estimate([5.0, 0, 0, 0, 0, 0]), target())
    np.testing.assert_array_equal(commands[100].force, held.force)


def test_the_remainder_of_a_plan_is_the_guess_for_the_next(common, vehicle, estimate, target):
    law = ScriptedPlanner(common, vehicle)
    simulate(law, estimate, target, 21)
    assert law.tasks[0].guess is None
    np.testing.assert_allclose(law.tasks[1].guess, [[5e-5, 0, 0]] * 16, atol=1e-18)


@pytest.mark.parametrize(
    ("output", "words"),
    [
        (np.full(3, np.nan), "not finite"),
        (np.array([2e-4, 0, 0]), "final_time is too short: 2 times the thrust limit"),
        (np.linalg.LinAlgError("Singular matrix"), "Singular matrix"),
        (ZeroDivisionError("by zero"), "by zero"),
    ],
)
def test_an_invalid_plan_is_reported_and_lqr_or_the_plan_continues(output, words, common, vehicle, estimate, target):
    law = ScriptedPlanner(common, vehicle, output)
    (command,) = simulate(law, estimate, target, 1)
    assert words in command.fallback
    assert command.fallback.endswith("LQR active")
    held = ScriptedPlanner(common, vehicle).holding.command(estimate([5.0, 0, 0, 0, 0, 0]), target())
    np.testing.assert_array_equal(command.force, held.force)
    law.output = None
    commands = simulate(law, estimate, target, 25, 1)
    assert commands[18].fallback
    assert not commands[19].fallback  # at the next planning time
    law.output = output
    commands = simulate(law, estimate, target, 25, 26)
    assert words in commands[-1].fallback
    assert commands[-1].fallback.endswith("previous plan continues")
    np.testing.assert_allclose(commands[-1].force, HELD)


@pytest.mark.parametrize("before", FINITE_HORIZONS)
@pytest.mark.parametrize("after", FINITE_HORIZONS)
def test_a_swap_begins_a_reconfiguration_and_new_parameters_do_not(before, after, common, vehicle, estimate, target):
    old, new = (law(law.Parameters(final_time=500.0, step=50.0), common, vehicle) for law in (before, after))
    seen = estimate([1.0, 0, 0, 0, 0, 0], chief=CHIEF)
    assert old.command(seen, target()).solver == "planned"
    new.activate(Handover(np.zeros(3), "before", old))
    later = dataclasses.replace(seen, time=10 * NANOSECONDS)
    assert new.command(later, target(time=10.0)).solver == ("following" if before is after else "planned")


def test_an_invalid_chief_state_is_reported(common, vehicle, estimate, target):
    command = ScriptedPlanner(common, vehicle).command(estimate(np.ones(6)), target())
    assert "no plan" in command.fallback
    assert np.isfinite(command.force).all()


def test_a_target_jump_restarts_the_reconfiguration_a_path_does_not(common, vehicle, estimate, target):
    law = ScriptedPlanner(common, vehicle)
    n = common.mean_motion
    small, large = (RelativeOrbit(RelativeOrbitParameters(rho=rho, m=1.0), n) for rho in (1000.0, 1010.0))

    def path(time):
        return (small if time < 600.0 else large).states(np.array([time]))[0]

    commands = simulate(law, estimate, target, 180, goal=path)
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
def test_free_orbits_do_not_jump_and_steps_between_them_do(rho, m, tick, theta, step, target):
    n = 1.1e-3
    near = RelativeOrbit(RelativeOrbitParameters(rho=rho, m=m, theta=theta), n).states(np.array([0.0, tick]))
    far = RelativeOrbit(RelativeOrbitParameters(rho=rho, m=m, theta=theta, b=step), n).states(np.array([tick]))
    assert not has_jumped(target(near[0]), target(near[1], tick))
    if step > 1.0 + 0.05 * np.linalg.norm(near[1] - near[0]):
        assert has_jumped(target(near[0]), target(far[0], tick))


def test_new_parameters_continue_and_a_past_final_time_is_reported(common, vehicle, estimate, target):
    law, other = ScriptedPlanner(common, vehicle), ScriptedPlanner(common, vehicle, final_time=400.0)
    simulate(law, estimate, target, 50)
    other.activate(Handover(np.zeros(3), "scripted", law))
    (command,) = simulate(other, estimate, target, 1, 50)
    assert command.fallback == "final_time is past by 100 s; LQR active"
    longer = ScriptedPlanner(common, vehicle, final_time=2000.0)
    longer.activate(Handover(np.zeros(3), "scripted", law))
    simulate(longer, estimate, target, 20, 51)
    assert longer.tasks[0].duration == pytest.approx(1400.0)  # counted from the start of the reconfiguration


def test_the_goal_is_the_preview_then_free_motion_from_its_end(common, target):
    """On a relative orbit so small that Hill's equations are exact."""
    orbit = RelativeOrbit(RelativeOrbitParameters(rho=1.0, m=1.0), common.mean_motion)
    model = NonlinearModel(KeplerChief(common.chief.semi_major_axis))
    times = 60.0 * np.arange(11)
    states = orbit.states(times)
    aim = target(states[0], preview=states[1:], step=60.0)
    for ahead in (0.0, 1.0, 100.0, 599.0, 600.0, 5000.0):
        # Cubic: (n h)^4 / 384 of 2 m in position, (n h)^3 / 72 in velocity. Second-order drift: about 30 times
        # (1 m)^2 over the radius per revolution.
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
def test_the_mean_of_a_plan_preserves_its_impulse_over_any_intervals(forces, cuts):
    plan = Plan(np.array(forces), 100.0)
    edges = np.unique(np.concatenate([[0.0, 100.0], 100.0 * np.array(cuts)]))
    edges = edges[np.append(True, np.diff(edges) > 1e-6)]
    impulse = plan.mean(edges[:-1], edges[1:]) * np.diff(edges)[:, None]
    total = plan.acceleration.sum(axis=0) * 100.0 / len(forces)
    np.testing.assert_allclose(impulse.sum(axis=0), total, atol=1e-4)


def test_too_many_steps_are_rejected(common, vehicle):
    with pytest.raises(DesignError, match=f"at most {MAX_STEPS} steps"):
        ScriptedPlanner(common, vehicle, step=0.1)


def test_an_axis_without_thrust_only_rejects_plans_that_use_it(common, estimate, target):
    vehicle = Vehicle(100.0, np.array([0.01, 0.01, 0.0]))
    (command,) = simulate(ScriptedPlanner(common, vehicle), estimate, target, 1)
    assert command.solver == "planned"
    (command,) = simulate(ScriptedPlanner(common, vehicle, np.array([0.0, 0.0, 1e-5])), estimate, target, 1)
    assert "too short" in command.fallback


PLANT_CASES = {
    "LEO": (Orbit(6978100.0, inclination=0.87), 10.0, 1500.0, 30.0),
    "LEO, ticks of a second": (Orbit(6978100.0, inclination=0.87), 1.0, 500.0, 20.0),
    "eccentric": (Orbit(7.5e6, eccentricity=0.08, inclination=0.87, argument_of_perigee=1.0), 10.0, 1500.0, 30.0),
    "GEO": (Orbit(42164e3, inclination=0.1), 60.0, 6000.0, 60.0),
}


@pytest.mark.parametrize("case", PLANT_CASES)
@pytest.mark.parametrize("name", ["mpsp", "gmpsp", "asre"])
def test_one_plan_reaches_its_goal_on_the_plant(name, case, estimate, target):
    """The plant holds the thrust inertially, in the Hill axes of the tick's start."""
    orbit, tick, final, step = PLANT_CASES[case]
    law = ALGORITHMS[name](
        ALGORITHMS[name].Parameters(final_time=final, step=step, last_plan=final),
        CommonParameters(orbit, tick=tick), Vehicle(100.0, np.full(3, 10.0)),
    )  # fmt: skip
    states = np.array([[60.0, 190.0, 30.0, 0.0, -0.1, 0.0], [0.0, -100.0, 0.0, 0.0, 0.0, 0.0]])
    chief = state_from_elements(Elements(**vars(orbit)))
    deputy, goal = (inertial_from_relative(chief, each) for each in states)
    for index in range(round(final / tick)):
        seen, aim = (relative_from_inertial(chief, each) for each in (deputy, goal))
        command = law.command(estimate(seen, index * tick, chief=chief), target(aim, index * tick))
        assert not command.fallback
        thrust = command.force @ hill_rotation(chief) / 100.0
        deputy = propagate_with_transition(deputy, thrust, tick, 4)[0]
        chief, goal = (propagate_with_transition(each, np.zeros(3), tick, 4)[0] for each in (chief, goal))
    miss = relative_from_inertial(chief, deputy) - relative_from_inertial(chief, goal)
    # Within a tick the turning thrust gains w T^2 / 12 of its change: some millimetres.
    assert np.linalg.norm(miss[:3]) < 0.01


def test_the_held_thrust_has_the_impulse_of_the_turning_one():
    orbit, tick, acceleration = Orbit(1.0e7, eccentricity=0.3, true_anomaly=1.0), 30.0, np.array([2e-5, -1e-5, 3e-5])
    chief = state_from_elements(Elements(**vars(orbit)))
    axes, turned, steps = hill_rotation(chief), np.zeros(3), 300
    for index in range(steps):
        later = propagate_with_transition(chief, np.zeros(3), (index + 0.5) * tick / steps, 4)[0]
        turned += acceleration @ hill_rotation(later) / steps
    # The rate of the frame is taken as linear over the tick.
    np.testing.assert_allclose(held_over_tick(acceleration, chief, tick), axes @ turned, rtol=0.0, atol=1e-5 * 3e-5)
