"""SDRE over infinite and finite horizons, and ASRE."""

import dataclasses

import numpy as np
import pytest

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.asre import Asre, AsreParameters
from formation_gnc.control.controller import Handover, Vehicle
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.plan import Task
from formation_gnc.control.sdre import Sdre, SdreParameters
from formation_gnc.control.sdre_finite import FiniteSdre, SdreFiniteParameters
from formation_gnc.errors import DesignError
from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.nonlinear import NonlinearModel

WEIGHTS = {"position_error": (10.0,) * 3, "velocity_error": (0.1,) * 3, "thrust": (0.002,) * 3}
CHIEF = Elements(1e7, 0.15, 1.0, 0.3, 0.2, 0.17)
STRONG = Vehicle(100.0, np.full(3, 50.0))


def simulate(law, estimate, target, start, goal, ticks, tick=10.0, chief=CHIEF, disturbance=0.0):
    """States (N + 1, 6) and commands, on two absolute orbits with J2."""
    leader = state_from_elements(chief)
    follower = inertial_from_relative(leader, start)
    states, commands = [start], []
    for index in range(ticks):
        time = index * tick
        aim = goal(time) if callable(goal) else goal
        commands.append(law.command(estimate(states[-1], time, chief=leader), target(aim, time)))
        thrust = (commands[-1].force + disturbance) @ hill_rotation(leader) / 100.0
        leader = propagate_with_transition(leader, np.zeros(3), tick, 1)[0]
        follower = propagate_with_transition(follower, thrust, tick, 1)[0]
        states.append(relative_from_inertial(leader, follower))
    return np.array(states), commands


def test_near_a_circular_kepler_chief_sdre_is_lqr(common, vehicle, estimate, target):
    chief = state_from_elements(Elements(**vars(common.chief)))
    sdre = Sdre(SdreParameters(model="nonlinear", **WEIGHTS), common, vehicle)
    lqr = LinearQuadraticRegulator(LqrParameters(**WEIGHTS), common, vehicle)
    state = np.array([0.5, -0.8, 0.3, 1e-3, 2e-3, -1e-3])
    ours = sdre.command(estimate(state, chief=chief), target()).force
    np.testing.assert_allclose(ours, lqr.command(estimate(state), target()).force, rtol=1e-6)


@pytest.mark.parametrize("factorisation", ["sdc1", "sdc2"])
def test_the_gain_stabilises_the_matrix_of_its_design(factorisation):
    law = Sdre(SdreParameters(factorisation=factorisation, **WEIGHTS), CommonParameters(Orbit(1e7)), STRONG)
    model = NonlinearModel(KeplerChief.of(CHIEF))
    for time in np.linspace(0.0, model.period, 7):
        dynamics = model.dynamics(float(time), np.array([2e4, -4e4, 3e4, 0, 0, 0]))
        gain = law.gain(dynamics)
        closed = dynamics - np.vstack([np.zeros((3, 6)), gain])
        assert np.linalg.eigvals(closed).real.max() < 0.0


def test_sdre_acquires_and_holds_a_distant_free_orbit(estimate, target):
    """50 km about an eccentric chief, with a target in exact free motion."""
    goal_start = np.array([1.5e4, 4e4, 2e4, 5.0, -20.0, 3.0])
    leader = state_from_elements(CHIEF)
    deputy = inertial_from_relative(leader, goal_start)
    goals = []
    for _ in range(401):
        goals.append(relative_from_inertial(leader, deputy))
        leader, deputy = (propagate_with_transition(each, np.zeros(3), 10.0, 1)[0] for each in (leader, deputy))
    weights = {"position_error": (100.0,) * 3, "velocity_error": (1.0,) * 3, "thrust": (2.0,) * 3}
    law = Sdre(SdreParameters(**weights), CommonParameters(Orbit(1e7, 0.15), tick=10.0), STRONG)
    states, commands = simulate(
        law,
        estimate,
        target,
        goal_start + np.array([3e3, -2e3, 1e3, 0, 0, 0]),
        lambda time: goals[round(time / 10.0)],
        400,
    )
    assert not any(command.fallback for command in commands)
    assert np.linalg.norm((states[-1] - goals[-1])[:3]) < 0.1  # of 3.7 km


@pytest.mark.thorough
@pytest.mark.covers("Joshi (5.1)-(5.7)", "control/sdre.py")
def test_the_integral_removes_the_offset_of_a_constant_force(estimate, target):
    common = CommonParameters(Orbit(1e7, 0.0), tick=10.0)
    chief = dataclasses.replace(CHIEF, eccentricity=0.0)
    left = {}
    for integral in (0.0, 2e4):
        law = Sdre(SdreParameters(integral_error=integral, **WEIGHTS), common, STRONG)
        states, _ = simulate(law, estimate, target, np.zeros(6), np.zeros(6), 1500, chief=chief, disturbance=1e-3)
        left[integral] = np.linalg.norm(states[-1, :3])
    assert left[0.0] > 1.0
    assert left[2e4] < 0.05 * left[0.0]


def test_a_change_of_parameters_keeps_the_integral(common, vehicle, estimate, target):
    law, other = (Sdre(SdreParameters(integral_error=100.0, **WEIGHTS), common, vehicle) for _ in range(2))
    chief = state_from_elements(Elements(**vars(common.chief)))
    for tick in range(5):
        law.command(estimate([0.1, 0.1, 0.1, 0, 0, 0], 10.0 * tick, chief=chief), target(time=10.0 * tick))
    other.activate(Handover(np.zeros(3), "sdre", law))
    seen, aim = estimate(np.zeros(6), 50.0, chief=chief), target(time=50.0)
    assert other.command(seen, aim).force.any()
    np.testing.assert_allclose(other.command(seen, aim).force, law.command(seen, aim).force, rtol=1e-6)


def test_a_missing_gain_is_reported_and_lqr_is_active(common, vehicle, estimate, target):
    law = Sdre(SdreParameters(**WEIGHTS), common, vehicle)
    state = np.array([5.0, -8.0, 3.0, 0.0, 0.0, 0.0])
    for chief, words in ((np.zeros(6), "no gain"), (np.full(6, np.nan), "no gain")):
        command = law.command(estimate(state, chief=chief), target())
        assert words in command.fallback
        np.testing.assert_array_equal(command.force, law.fallback_law.command(estimate(state), target()).force)
    # So far away that the matrices overflow.
    chief = state_from_elements(Elements(**vars(common.chief)))
    with np.errstate(all="ignore"):
        assert "LQR active" in law.command(estimate(1e160 * state, 10.0, chief=chief), target(time=10.0)).fallback


def test_inadmissible_weights_are_rejected(common, vehicle):
    with pytest.raises(DesignError, match="sdre: state_weight has 2 values"):
        Sdre(SdreParameters(state_weight=(1.0, 2.0)), common, vehicle)


@pytest.mark.parametrize(("law", "parameters"), [(FiniteSdre, SdreFiniteParameters), (Asre, AsreParameters)])
@pytest.mark.thorough
def test_a_reconfiguration_arrives_on_time_and_is_held(law, parameters, estimate, target):
    """From within 1 km to 8 km about an eccentric chief with J2."""
    common = CommonParameters(Orbit(1e7, 0.15), tick=10.0)
    start = np.array([353.0, 707.0, 353.0, 0.22, -0.44, 0.22])
    leader = state_from_elements(CHIEF)
    deputy = inertial_from_relative(leader, np.array([3800.0, 5900.0, 4200.0, 1.0, -4.0, 1.5]))
    goals = []
    for _ in range(251):
        goals.append(relative_from_inertial(leader, deputy))
        leader, deputy = (propagate_with_transition(each, np.zeros(3), 10.0, 1)[0] for each in (leader, deputy))
    controller = law(parameters(final_time=2000.0, last_plan=60.0, replan_interval=60.0, **WEIGHTS), common, STRONG)
    states, commands = simulate(controller, estimate, target, start, lambda time: goals[round(time / 10.0)], 250)
    assert not any(command.fallback for command in commands)
    assert [command.solver for command in commands[199:202]] == ["following", "holding", "holding"]
    off = np.linalg.norm((states - goals)[:, :3], axis=1)
    assert off[0] > 5000.0
    # The last plan of SDRE, 80 s before the end, has frozen matrices: an error of (n t)^3.
    assert off[200] < (0.1 if law is Asre else 2.0)
    assert off[-1] < 2.0


def test_the_design_figures_have_the_gain_and_the_schedule(common, vehicle):
    sdre = Sdre(SdreParameters(model="nonlinear", **WEIGHTS), common, vehicle).figures()
    lqr = LinearQuadraticRegulator(LqrParameters(**WEIGHTS), common, vehicle).figures()
    (gain,) = sdre.values()
    expected = np.array(lqr["gain [N/m, N/(m/s), N/(m s)]"])
    np.testing.assert_allclose(gain, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    parameters = AsreParameters(final_time=2000.0, step=30.0, replan_interval=300.0, last_plan=500.0)
    figures = Asre(parameters, common, vehicle).figures()
    assert figures["steps of the first plan"] == 67
    assert figures["plans in a reconfiguration"] == 5  # at 0, 300 ... 1200 s


def test_a_plan_is_a_pure_function_of_its_task(common):
    model = NonlinearModel(KeplerChief.of(CHIEF))
    task = Task(model, 0.0, np.array([300.0, 700, 300, 0.2, -0.4, 0.2]), np.zeros(6), 1000.0, 20)
    for law in (
        FiniteSdre(SdreFiniteParameters(), common, STRONG),
        Asre(AsreParameters(), common, STRONG),
    ):
        first, second = law.plan(task), law.plan(task)
        np.testing.assert_array_equal(first.acceleration, second.acceleration)


def test_a_sequence_that_does_not_converge_is_reported(common, vehicle, estimate, target):
    law = Asre(AsreParameters(max_iterations=1, **WEIGHTS), common, vehicle)
    chief = state_from_elements(Elements(**vars(common.chief)))
    command = law.command(estimate([20.0, 0, 0, 0, 0, 0], chief=chief), target())
    assert command.fallback.startswith("no plan: not converged in 1 iterations")


@pytest.mark.parametrize("law", [FiniteSdre, Asre])
def test_only_the_radial_axis_is_dispensable(law, common, estimate, target):
    """Every state is reachable without radial thrust, but not without along-track or cross-track thrust."""
    chief = state_from_elements(Elements(**vars(common.chief)))
    with pytest.raises(DesignError, match="along the track"):
        law(law.Parameters(**WEIGHTS), common, Vehicle(100.0, np.array([0.05, 0.0, 0.05])))
    for idle, words in ((0, ""), (2, "no plan")):
        limit = np.full(3, 0.05)
        limit[idle] = 0.0
        controller = law(law.Parameters(**WEIGHTS), common, Vehicle(100.0, limit))
        command = controller.command(estimate([2.0, 5.0, 5.0, 0, 0, 0], chief=chief), target())
        if words:
            assert words in command.fallback
        else:
            assert not command.fallback
            assert command.force[idle] == 0.0
            assert command.force.any()


def test_a_single_step_is_reported_as_singular(common, vehicle, estimate, target):
    law = FiniteSdre(SdreFiniteParameters(final_time=20.0, **WEIGHTS), common, vehicle)
    chief = state_from_elements(Elements(**vars(common.chief)))
    command = law.command(estimate([20.0, 0, 0, 0, 0, 0], chief=chief), target())
    assert "singular" in command.fallback


def test_hill_ellipse_about_a_kepler_chief_needs_no_thrust(estimate, target):
    """On the target the command is zero: feedback and factorisation terms both vanish."""
    common = CommonParameters(Orbit(6978100.0), tick=10.0)
    orbit = RelativeOrbit(RelativeOrbitParameters(rho=100.0, m=1.0), common.mean_motion)
    law = Sdre(SdreParameters(model="nonlinear", **WEIGHTS), common, Vehicle(100.0, np.full(3, 0.01)))
    chief = state_from_elements(Elements(6978100.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    state = orbit.states(np.zeros(1))[0]
    force = law.command(estimate(state, chief=chief), target(state)).force
    assert not force.any()
