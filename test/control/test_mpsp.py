"""MPSP and G-MPSP as laws, on two absolute orbits with J2."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.fixed_endpoint_lq import Cost, solve_fixed_endpoint
from formation_gnc.control.gmpsp import GmpspController
from formation_gnc.control.mpsp import MpspController
from formation_gnc.control.plan import Plan, Task
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.parameters import load
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.nonlinear import NonlinearModel

LAWS = ("mpsp", "gmpsp")
ECCENTRIC = Orbit(7.5e6, eccentricity=0.08, inclination=0.87, argument_of_perigee=1.0)
START = np.array([60.0, 190.0, 30.0, 0.0, -0.1, 0.0])
GOAL = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0])
FINAL = 1500.0
PARAMETERS = {"final_time": FINAL, "step": 50.0, "replan_interval": 100.0, "last_plan": 250.0}


@pytest.fixture(scope="module")
def eccentric():
    return CommonParameters(ECCENTRIC, tick=10.0)


def law_of(name, common, limit=0.1, **changes):
    law = ALGORITHMS[name]
    return law(law.Parameters(**(PARAMETERS | changes)), common, Vehicle(100.0, np.full(3, limit)))


def simulate(law, common, estimate, target, error=lambda time: np.zeros(6)):
    """States at every tick until the final time, the goal then, and the commands; with an estimation error."""
    chief = state_from_elements(Elements(**vars(common.chief)))
    deputy, goal = inertial_from_relative(chief, START), inertial_from_relative(chief, GOAL)
    states, commands = [START], []
    for index in range(round(FINAL / 10.0)):
        time = 10.0 * index
        seen = estimate(states[-1] + error(time), time, chief=chief)
        # The target is in free motion from GOAL, as in guidance.
        commands.append(law.command(seen, target(relative_from_inertial(chief, goal), time)))
        thrust = commands[-1].force @ hill_rotation(chief) / 100.0
        deputy = propagate_with_transition(deputy, thrust, 10.0, 1)[0]
        chief, goal = (propagate_with_transition(each, np.zeros(3), 10.0, 1)[0] for each in (chief, goal))
        states.append(relative_from_inertial(chief, deputy))
    return np.array(states), relative_from_inertial(chief, goal), commands


@pytest.mark.parametrize("name", LAWS)
def test_it_arrives_on_time_about_an_eccentric_chief_with_j2(name, eccentric, estimate, target):
    states, goal, commands = simulate(law_of(name, eccentric), eccentric, estimate, target)
    assert not any(command.fallback for command in commands)
    # Residual: the rotation of the axes within ticks of 10 s.
    assert np.linalg.norm(states[-1, :3] - goal[:3]) < 0.01
    assert np.linalg.norm(states[-1, 3:] - goal[3:]) < 5e-5
    assert np.linalg.norm(START[:3] - GOAL[:3]) > 250.0


@pytest.mark.parametrize("name", LAWS)
def test_a_guess_that_reaches_the_goal_is_still_optimised(name):
    """In a near-linear case the LQR guess meets the tolerance at twenty times the optimal effort."""
    common, time, count = CommonParameters(Orbit(42164e3), tick=10.0), 30000.0, 300
    weights = {"position_error": (200.0,) * 3, "velocity_error": (0.05,) * 3, "thrust": (0.01,) * 3}
    law = law_of(name, common, final_time=time, step=time / count, **weights)
    start, model = np.array([80.0, -60.0, 40.0, 0.0, 0.0, 0.0]), HillModel(common.mean_motion)
    task = Task(NonlinearModel(KeplerChief(42164e3)), 0.0, start, np.zeros(6), time, count)
    phi, gamma = (np.broadcast_to(each, (count, *each.shape)) for each in model.discretise(0.0, task.step))
    cost = Cost(np.zeros((6, 6)), np.eye(3), np.zeros((6, 6)))
    least = Plan(solve_fixed_endpoint(phi, gamma, start, np.zeros(6), cost).inputs, time).cost
    plan = law.plan(task)
    assert not plan.failure
    assert plan.cost == pytest.approx(least, rel=1e-3)  # nonlinearity 2e-6, held thrust of G-MPSP 1e-5


@pytest.mark.parametrize("name", LAWS)
def test_replanning_removes_the_error_of_a_poor_first_estimate(name, eccentric, estimate, target):
    """Estimation error of 5 m and 1 cm/s that decays within some minutes."""

    def error(time):
        return np.repeat([5.0, 0.01], 3) * np.exp(-time / 200.0)

    replanned, goal, _ = simulate(law_of(name, eccentric), eccentric, estimate, target, error)
    once, _, _ = simulate(law_of(name, eccentric, replan_interval=1e4), eccentric, estimate, target, error)
    assert np.linalg.norm(once[-1, :3] - goal[:3]) > 10.0
    # The last plan is made 250 s before the end, when 5 m exp(-1250 / 200) = 1 cm is left.
    assert np.linalg.norm(replanned[-1, :3] - goal[:3]) < 0.1


def test_a_model_without_j2_leaves_a_larger_terminal_error(eccentric, estimate, target):
    misses = []
    for model in ("nonlinear", "oblate"):
        law = law_of("mpsp", eccentric, model=model, replan_interval=1e4)
        states, goal, _ = simulate(law, eccentric, estimate, target)
        misses.append(np.linalg.norm(states[-1, :3] - goal[:3]))
    # Differential J2 over 300 m: 300 m (3 J2 (R/a)^2) (n t)^2 / 2 is 1 m and more.
    assert misses[0] > 0.3
    assert misses[1] < 0.02


@pytest.mark.covers("Joshi (6.12)-(6.27)", "control/static_programming.py")
def test_the_terminal_error_of_euler_is_first_order_in_the_step(eccentric, estimate, target):
    misses = []
    for prediction, step in (("euler", 50.0), ("euler", 10.0), ("rk4", 50.0)):
        law = law_of("mpsp", eccentric, prediction=prediction, step=step, replan_interval=1e4)
        states, goal, _ = simulate(law, eccentric, estimate, target)
        misses.append(np.linalg.norm(states[-1, :3] - goal[:3]))
    assert misses[0] > 3.0 * misses[1] > 9.0 * misses[2]  # RK4 is far below


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"final_time": 200.0}, "final_time is too short"),
        ({"max_iterations": 1, "final_time": 3000.0}, "1 iterations leave"),
    ],
)
def test_an_infeasible_plan_is_reported_and_lqr_is_active(name, changes, words, eccentric, estimate, target):
    law = law_of(name, eccentric, **changes)
    far = 300.0 * START if "max_iterations" in changes else START  # 60 km: nonlinear
    chief = state_from_elements(Elements(**vars(eccentric.chief)))
    command = law.command(estimate(far, chief=chief), target(GOAL))
    assert words in command.fallback
    assert command.fallback.endswith("LQR active")
    holding = law_of(name, eccentric, **changes).holding
    np.testing.assert_array_equal(command.force, holding.command(estimate(far, chief=chief), target(GOAL)).force)


@pytest.mark.parametrize("law", [MpspController, GmpspController])
@pytest.mark.parametrize(("limit", "words"), [((0.0, 0.1, 0.1), ""), ((0.1, 0.1, 0.0), "singular")])
def test_only_the_radial_axis_is_dispensable(law, limit, words, eccentric, estimate, target):
    """Along-track thrust controls the in-plane motion; only cross-track thrust controls the out-of-plane motion."""
    parameters = law.Parameters(model="nonlinear", final_time=4000.0, step=50.0)
    controller = law(parameters, eccentric, Vehicle(100.0, np.array(limit)))
    chief = state_from_elements(Elements(**vars(eccentric.chief)))
    command = controller.command(estimate(START, chief=chief), target(GOAL))
    if words:
        assert words in command.fallback
    else:
        assert not command.fallback
        assert command.force[0] == 0.0


numbers = st.floats(-1e7, 1e7)


@settings(max_examples=40)
@given(
    name=st.sampled_from(LAWS),
    states=st.lists(st.lists(numbers, min_size=6, max_size=6), min_size=2, max_size=2),
    chief=st.lists(st.floats(-1e8, 1e8), min_size=6, max_size=6),
    on_orbit=st.booleans(),
    final_time=st.floats(1.0, 3000.0),
    prediction=st.sampled_from(["rk4", "euler"]),
)
@pytest.mark.thorough
def test_any_input_gives_a_finite_force_within_the_limit(
    name, states, chief, on_orbit, final_time, prediction, estimate, target
):
    values = {"chief.semi_major_axis": 7.5e6, "tick": 10.0, "algorithm": name}
    values |= {f"{name}.final_time": final_time, f"{name}.step": 100.0, f"{name}.replan_interval": 0.0}
    if name == "mpsp":
        values["mpsp.prediction"] = prediction
    manager = ControllerManager("controller", load(ControllerParameters, values))
    if on_orbit:
        chief = state_from_elements(Elements(7.5e6, 0.08, 0.87, 0.0, 1.0, 0.0))
    for tick in range(2):
        thrust, status = manager.on_tick(
            estimate(states[tick], 10.0 * tick, chief=np.array(chief)), target(states[0], 10.0 * tick)
        )
        assert np.isfinite(thrust.force).all()
        assert (np.abs(thrust.force) <= 0.01).all()
        assert np.isfinite(status.demand).all()
        assert status.solver in ("planned", "following") or status.fallback or 10.0 * tick >= final_time
