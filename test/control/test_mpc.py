import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra import numpy as hnp
from scipy.optimize import lsq_linear

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Handover, Vehicle
from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.mpc import ModelPredictiveController, MpcParameters, longest_eclipse
from formation_gnc.errors import DesignError
from formation_gnc.parameters import load
from formation_gnc.records import NO_ECLIPSES, NO_NEIGHBOURS
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

ROBERTS = MpcParameters(position_error=(10.0,) * 3, velocity_error=(0.1,) * 3, thrust=(0.002,) * 3)
OFFSET = [10.0, 10.0, 10.0, 0.0, 0.0, 0.0]


def make(common, vehicle, **changes):
    return ModelPredictiveController(dataclasses.replace(ROBERTS, **changes), common, vehicle)


def simulate(law, model, estimate, target, start, ticks, tick=10.0, mass=100.0, eclipses=NO_ECLIPSES):
    states, commands = [np.asarray(start, dtype=float)], []
    for index in range(ticks):
        time = index * tick
        commands.append(law.command(estimate(states[-1], time, mass), target(time=time, eclipses=eclipses)))
        phi, gamma = model.discretise(time, tick)
        states.append(phi @ states[-1] + gamma @ (commands[-1].force / mass))
    return np.array(states), np.array([command.force for command in commands]), commands


def test_without_active_constraints_it_is_the_lqr(common, vehicle, estimate, target):
    for state in (OFFSET, [0, 5, 0, 0.01, 0, 0], [-3, 0, 8, 0, -0.01, 0.01]):
        law = make(common, vehicle, step=10.0)
        expected = law.fallback_law.command(estimate(state), target()).force
        # Solver accuracy: 1e-4 of the thrust limit, times some tens along the flat directions of the cost.
        np.testing.assert_allclose(law.command(estimate(state), target()).force, expected, rtol=0.0, atol=3e-5)


@pytest.mark.covers("Kremmydas 2.2", "control/mpc.py")
def test_weight_matrices_equal_the_corresponding_bryson_weights(common, vehicle, estimate, target):
    matrices = MpcParameters(
        state_weight=tuple(np.diag([0.01] * 3 + [100.0] * 3).ravel()),
        thrust_weight=tuple((np.eye(3) / 0.002**2).ravel()),
    )
    ours, theirs = (
        law.command(estimate(OFFSET), target()).force
        for law in (make(common, vehicle), ModelPredictiveController(matrices, common, vehicle))
    )
    np.testing.assert_allclose(ours, theirs, rtol=1e-6)


@pytest.mark.parametrize("weighting", ["running", "terminal"])
def test_the_plan_is_the_optimum_within_the_limits(weighting, common, vehicle, estimate, target):
    law = make(common, vehicle, weighting=weighting, position_error=(1.0,) * 3, velocity_error=(0.01,) * 3)
    state = np.array([40.0, -60.0, 30.0, 0.02, 0.0, 0.01])
    law.command(estimate(state), target())
    # The same problem as bounded least squares, solved by another method.
    qp = law.qps[0]
    roots = np.array([np.linalg.cholesky(weight + 1e-18 * np.eye(6)).T for weight in qp.weight])
    rows = np.vstack(
        [(roots @ qp.forced.reshape(30, 6, 90)).reshape(180, 90), np.eye(90) * (1.0 / 0.002 * 0.01)]
        if weighting == "terminal"
        else [
            (roots @ qp.forced.reshape(30, 6, 90)).reshape(180, 90),
            np.eye(90) * (6.0**0.5 / 0.002 * 0.01),
        ]
    )
    goal = -(roots @ (qp.free @ state).reshape(30, 6, 1)).ravel()
    best = lsq_linear(rows, np.concatenate([goal, np.zeros(90)]), (-1.0, 1.0), tol=1e-14, max_iter=500).x
    assert np.abs(best).max() > 0.999  # limits are active
    ours = law.plan.ravel() / 0.01
    excess = np.linalg.norm(rows @ ours - np.concatenate([goal, np.zeros(90)])) ** 2
    least = np.linalg.norm(rows @ best - np.concatenate([goal, np.zeros(90)])) ** 2
    assert excess <= least * (1.0 + 1e-3)
    np.testing.assert_allclose(ours[:3], best[:3], atol=0.02)


def test_an_offset_is_recovered_at_the_thrust_limit(common, vehicle, estimate, target):
    states, forces, _ = simulate(
        make(common, vehicle), HillModel(common.mean_motion), estimate, target, [60, 60, 60, 0, 0, 0], 900
    )
    assert np.abs(forces).max() == pytest.approx(0.01, rel=1e-3)
    assert np.abs(forces).max() <= 0.01
    assert np.linalg.norm(states[-1, :3]) < 0.1


@pytest.mark.thorough
def test_an_eccentric_chief_is_tracked_with_its_own_model(vehicle, estimate, target):
    common = CommonParameters(Orbit(1.0e7, eccentricity=0.3), tick=20.0)
    law = make(common, vehicle, model="tschauner_hempel")
    states, _, commands = simulate(
        law, TschaunerHempelModel(KeplerChief(1.0e7, 0.3)), estimate, target, OFFSET, 500, tick=20.0
    )
    assert np.linalg.norm(states[-1, :3]) < 0.01
    assert not any(command.fallback for command in commands)


@pytest.mark.thorough
def test_total_thrust_and_thrust_rate_stay_within_their_limits(common, vehicle, estimate, target):
    law = make(common, vehicle, total_thrust=0.01, thrust_rate=5e-5)
    states, forces, _ = simulate(law, HillModel(common.mean_motion), estimate, target, [60, 60, 60, 0, 0, 0], 900)
    assert np.linalg.norm(forces, axis=1).max() <= 0.01 * (1.0 + 1e-12)
    assert np.linalg.norm(forces, axis=1).max() > 0.0085
    steps = np.abs(np.diff(np.vstack([np.zeros(3), forces]), axis=0))
    assert steps.max() <= 5e-4 * (1.0 + 1e-3)  # the limit on total thrust has priority
    assert np.linalg.norm(states[-1, :3]) < 0.5


@pytest.mark.parametrize("replan_interval", [0.0, 1200.0])
@pytest.mark.thorough
@pytest.mark.covers(
    "Kremmydas 4.2.1",
    "control/mpc.py",
    "guidance/eclipse_forecast.py",
    differs="the eclipses of the orbit flown, not a fixed third of every plan",
)
def test_there_is_no_thrust_in_predicted_eclipses(replan_interval, common, vehicle, estimate, target):
    # Kremmydas: the last third of every orbit.
    law = make(common, vehicle, off_in_eclipse=True, horizon=50, replan_interval=replan_interval)
    period = 2.0 * np.pi / common.mean_motion
    windows = period * (np.arange(4)[:, None] + np.array([2.0 / 3.0, 1.0]))
    states, forces, _ = simulate(
        law,
        HillModel(common.mean_motion),
        estimate,
        target,
        [60, 60, 60, 0, 0, 0],
        1700,
        eclipses=windows,
    )
    begins = 10.0 * np.arange(1700)[:, None]
    dark = ((begins < windows[:, 1]) & (begins + 10.0 > windows[:, 0])).any(axis=1)
    assert 500 < dark.sum() < 600
    assert not forces[dark].any()
    assert np.abs(forces[~dark]).max() > 0.009
    assert np.linalg.norm(states[-1, :3]) < 0.5


def test_a_horizon_in_eclipse_throughout_is_planned_without_thrust(common, vehicle, estimate, target):
    law = make(common, vehicle, off_in_eclipse=True, horizon=50)
    command = law.command(estimate(OFFSET), target(eclipses=np.array([[0.0, 40000.0]])))
    assert command.solver == "solved"
    assert not command.force.any()


def test_thrust_stops_and_resumes_on_the_ticks_of_a_new_eclipse(common, vehicle, estimate, target):
    # The plan in force was made before the eclipse was predicted.
    law = make(common, vehicle, off_in_eclipse=True, horizon=50, replan_interval=3000.0)
    window, forces = np.array([[300.0, 600.0]]), []
    for tick in range(80):
        known = window if tick >= 20 else NO_ECLIPSES
        seen = estimate([60, 60, 60, 0, 0, 0], 10.0 * tick)
        forces.append(law.command(seen, target(time=10.0 * tick, eclipses=known)).force)
    assert [bool(force.any()) for force in forces] == [True] * 30 + [False] * 30 + [True] * 20


@pytest.mark.thorough
def test_the_thrust_is_down_when_an_eclipse_begins(common, vehicle, estimate, target):
    """The limit on the rate is planned ahead of the eclipse: neither contradicts the other."""
    rate, window = 5e-6, np.array([[1203.0, 3300.0]])
    law = make(common, vehicle, off_in_eclipse=True, horizon=50, thrust_rate=rate)
    _, forces, commands = simulate(
        law, HillModel(common.mean_motion), estimate, target, [60, 60, 60, 0, 0, 0], 140, eclipses=window
    )
    assert not any(command.fallback for command in commands)
    assert np.abs(forces[110:115]).max() > 1e-5
    assert not forces[120:].any()  # the eclipse begins within the tick from 1200 s
    # What the solver's accuracy leaves, a hundredth of the limit, is cut at the eclipse.
    steps = np.abs(np.diff(np.vstack([np.zeros(3), forces]), axis=0)).max(axis=1)
    assert np.delete(steps, 120).max() <= 10.0 * rate * (1.0 + 1e-3)
    assert steps[120] <= 10.0 * rate + 1e-4


def test_the_longest_eclipse_agrees_with_known_orbits():
    # Geostationary orbit: 69.4 min in the cylindrical shadow.
    assert longest_eclipse(Orbit(42164e3)) / 60.0 == pytest.approx(69.4, abs=0.2)
    assert longest_eclipse(Orbit(7078e3)) / 60.0 == pytest.approx(35.3, abs=0.3)
    assert longest_eclipse(Orbit(1e7, eccentricity=0.3)) > longest_eclipse(Orbit(1e7))


@pytest.mark.covers(
    "Kremmydas 2.4", "control/mpc.py", differs="online only: he rejects explicit MPC himself, for its memory"
)
def test_one_plan_is_applied_over_the_replan_interval(common, vehicle, estimate, target):
    law = make(common, vehicle, replan_interval=600.0)
    _, forces, commands = simulate(law, HillModel(common.mean_motion), estimate, target, OFFSET, 180)
    assert [index for index, command in enumerate(commands) if command.iterations] == [0, 60, 120]
    held = forces.reshape(30, 6, 3)
    np.testing.assert_array_equal(held, held[:, :1].repeat(6, axis=1))


# Kremmydas' NetSat: 1.5 kg, 8 uN, 240 s, thrust over two thirds of an orbit; axes along-track, cross-track, nadir.
NETSAT = CommonParameters(Orbit(7078137.0), tick=240.0)


def netsat(weight):
    """Terminal weight, squared, over scales of 2, 4 and 2 m, their rates and 2e-7 m/s^2 (listing of netSATmpc)."""
    return MpcParameters(
        step=240.0,
        horizon=33,
        control_horizon=18,
        replan_interval=25 * 240.0,
        weighting="terminal",
        position_error=(2.0 / weight, 4.0 / weight, 2.0 / weight),
        velocity_error=(0.002 / weight, 0.004 / weight, 0.002 / weight),
        thrust=(1.5 * 2e-7,) * 3,
    )


@pytest.mark.parametrize(("weight", "lower", "upper"), [(1.7, 10.0, 400.0), (17.0, 0.0, 1.0)])
@pytest.mark.covers(
    "Kremmydas Listing: netSATmpc: the MPC object",
    "control/mpc.py",
    differs="the target is carried to the end of the horizon: with that of now it lags by a third of an orbit",
)
@pytest.mark.covers("Kremmydas 4.3.1", "control/mpc.py")
def test_kremmydas_multistep_mpc_converges_to_a_moving_target(weight, lower, upper, estimate, target):
    model, rate = HillModel(NETSAT.mean_motion), NETSAT.mean_motion
    law = ModelPredictiveController(netsat(weight), NETSAT, Vehicle(1.5, np.full(3, 8e-6)))

    def ellipse(size, across, time):
        sine, cosine = np.sin(rate * time), np.cos(rate * time)
        position = np.array([size * sine, 2.0 * size * cosine, across * sine])
        return np.concatenate([position, rate * np.array([size * cosine, -2.0 * size * sine, across * cosine])])

    state, errors = ellipse(1000.0, 800.0, 0.0), []
    for index in range(2500):
        time = 240.0 * index
        force = law.command(estimate(state, time, 1.5), target(ellipse(1000.0, 0.0, time + 900.0), time)).force
        assert np.abs(force).max() <= 8e-6
        state = model.propagate(0.0, state, 240.0, force / 1.5)
        errors.append(np.linalg.norm((state - ellipse(1000.0, 0.0, time + 1140.0))[:3]))
    assert max(errors[:25]) > 800.0
    # After 100 orbits: tens to hundreds of metres with the printed weight, below one with ten times that.
    assert lower < max(errors[-25:]) < upper


@pytest.mark.covers("Kremmydas 2.1, cost", "control/mpc.py", differs="summed over the axes, a thruster each")
def test_the_absolute_cost_needs_less_delta_v(common, vehicle, estimate, target):
    used = {}
    for cost in ("quadratic", "absolute"):
        law = make(
            common, vehicle, cost=cost, weighting="terminal", horizon=60, position_error=(0.1,) * 3,
            velocity_error=(1e-4,) * 3, thrust=(0.01,) * 3, replan_interval=3600.0,
        )  # fmt: skip
        states, forces, _ = simulate(law, HillModel(common.mean_motion), estimate, target, OFFSET, 360)
        assert np.linalg.norm(states[-1, :3]) < 0.5
        used[cost] = np.abs(forces).sum()
    assert used["absolute"] < 0.9 * used["quadratic"]


@pytest.mark.covers(
    "Kremmydas 2.2, weights in time",
    "control/mpc.py",
    differs="weights are changed in flight, at any tick, and are the same over the horizon of a plan; that it saves "
    "fuel is not shown: an offset of 10 m drifts on meanwhile, and costs twice as much afterwards",
)
def test_weights_that_grow_in_flight_bring_a_soft_law_home(common, vehicle, estimate, target):
    """The target counts for less than fuel at first, and for more as the end comes near."""
    model, used, left = HillModel(common.mean_motion), {}, {}
    for name, weights in (("soft", (0.1, 0.1)), ("growing", (0.1, 3.0)), ("firm", (3.0, 3.0))):
        state, used[name] = OFFSET, 0.0
        for weight in weights:
            law = make(common, vehicle, position_error=(10.0 / weight,) * 3)
            states, forces, _ = simulate(law, model, estimate, target, state, 300)
            state, used[name] = states[-1], used[name] + np.abs(forces).sum()
        left[name] = np.linalg.norm(state[:3])
    assert used["soft"] < used["firm"]
    assert left["growing"] < 0.1 * left["soft"]


def pass_chief(law, common, estimate, target, others=NO_NEIGHBOURS):
    """States of a transfer from 60 m ahead of the chief to 60 m behind, and of others in free motion."""
    model, aim = HillModel(common.mean_motion), np.array([0.0, -60.0, 0.0, 0.0, 0.0, 0.0])
    state, states, theirs = np.array([0.0, 60.0, 1.0, 0.0, 0.0, 0.0]), [], []
    for index in range(600):
        time = 10.0 * index
        command = law.command(estimate(state, time), target(aim, time, neighbours=others))
        assert not command.fallback
        states.append(state)
        theirs.append(others)
        state = model.propagate(0.0, state, 10.0, command.force / 100.0)
        others = model.propagate(0.0, others, 10.0)
    assert np.linalg.norm(state[:3] - aim[:3]) < 3.0
    return np.array(states), np.array(theirs)


@pytest.mark.thorough
def test_the_keep_out_sphere_about_the_chief_is_avoided(common, vehicle, estimate, target):
    closest = {}
    for radius, chief in ((0.0, True), (40.0, False), (40.0, True)):
        law = make(common, vehicle, keep_out_radius=radius, keep_out_chief=chief)
        states, _ = pass_chief(law, common, estimate, target)
        closest[radius, chief] = np.linalg.norm(states[:, :3], axis=1).min()
    assert closest[0.0, True] < 30.0
    assert closest[40.0, False] < 30.0
    assert closest[40.0, True] > 38.0  # soft constraint


@pytest.mark.thorough
def test_keep_out_spheres_about_moving_neighbours_are_avoided(common, vehicle, estimate, target):
    # Two neighbours on closed orbits that meet the unconstrained path at different times.
    model, n = HillModel(common.mean_motion), common.mean_motion
    alone, _ = pass_chief(make(common, vehicle), common, estimate, target)
    others = []
    for tick, rate in ((110, 0.02), (180, -0.02)):
        x, y, z = alone[tick, :3] + [2.0, 1.0, -1.0]
        others.append(model.propagate(0.0, np.array([x, y, z, 0.0, -2.0 * n * x, rate]), -10.0 * tick))
    closest = {}
    for radius in (0.0, 20.0):
        law = make(common, vehicle, keep_out_radius=radius, keep_out_chief=False)
        states, theirs = pass_chief(law, common, estimate, target, np.array(others))
        apart = np.linalg.norm(states[:, None, :3] - theirs[:, :, :3], axis=2)
        closest[radius] = apart.min(axis=0)
    assert (closest[0.0] < 3.0).all()
    assert (closest[20.0] > 18.5).all()  # soft constraint


def test_a_preview_on_the_steps_of_the_plan_is_tracked(common, vehicle, estimate, target):
    law, other = make(common, vehicle), make(common, vehicle)
    drifting = np.tile([30.0, 0.0, 0.0, 0.0, 0.0, 0.0], (30, 1))
    with_preview = law.command(estimate(np.zeros(6)), target(np.zeros(6), preview=drifting)).force
    assert with_preview[0] > 1e-3
    wrong_step = other.command(estimate(np.zeros(6)), target(np.zeros(6), preview=drifting, step=10.0)).force
    assert np.abs(wrong_step).max() < 1e-6


def test_an_infeasible_qp_falls_back_to_the_previous_plan_or_lqr(common, vehicle, estimate, target):
    law = make(common, vehicle, off_in_eclipse=True, thrust_rate=1e-6, horizon=50)
    law.activate(Handover(np.full(3, 0.01), "coast"))
    first = law.command(estimate(OFFSET), target(eclipses=np.array([[350.0, 2000.0]])))
    # 350 s do not suffice to reduce 10 mN to zero at 1 uN/s.
    assert first.fallback.startswith("mpc: primal infeasible")
    assert first.fallback.endswith("no plan, LQR active")
    # The fallback law is limited to the rate as well.
    np.testing.assert_allclose(first.force, np.full(3, 0.01) - 1e-5)
    good = make(common, vehicle)
    planned = good.command(estimate(OFFSET), target())
    lost = good.command(estimate(1e200 * np.ones(6), 10.0), target(time=10.0))
    assert lost.fallback == "mpc: error out of range; previous plan continues"
    np.testing.assert_array_equal(lost.force, planned.force)
    again = good.command(estimate(OFFSET, 20.0), target(time=20.0))
    assert not again.fallback


@settings(deadline=None)
@given(states=hnp.arrays(float, (4, 6), elements={"min_value": -1e12, "max_value": 1e12}))
def test_any_sequence_of_estimates_gives_bounded_thrust(states, estimate, target):
    values = {"chief.semi_major_axis": 6978100.0, "tick": 10.0, "algorithm": "mpc", "mpc.horizon": 6}
    manager = ControllerManager("controller", load(ControllerParameters, values))
    for tick, state in enumerate(states):
        thrust, _ = manager.on_tick(estimate(state, 10.0 * tick), target(time=10.0 * tick))
        assert (np.abs(thrust.force) <= 0.01).all()


def test_equal_inputs_give_equal_bits(common, vehicle, estimate, target):
    flights = [
        simulate(
            make(common, vehicle),
            HillModel(common.mean_motion),
            estimate,
            target,
            [60, 60, 60, 0, 0, 0],
            100,
        )[1]
        for _ in range(2)
    ]
    np.testing.assert_array_equal(flights[0], flights[1])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"step": 15.0}, "step is 15.0 s; it must be a whole number of ticks of 10.0 s"),
        (
            {"off_in_eclipse": True, "horizon": 50, "thrust_rate": 1e-5, "replan_interval": 600.0},
            "off_in_eclipse and thrust_rate contradict each other in a plan that is kept for 600 s",
        ),
        ({"control_horizon": 31}, "control_horizon is 31 steps; it must be at most horizon, 30"),
        ({"off_in_eclipse": True}, "the horizon with thrust, 1800 s, is not longer than the eclipse, 21"),
        (
            {"state_weight": tuple(-np.eye(6).ravel())},
            "mpc: fallback law: lqr: the state weight has a normalised",
        ),
    ],
)
def test_inadmissible_parameters_are_rejected_with_the_reason(changes, message, common, vehicle):
    with pytest.raises(DesignError, match=message):
        make(common, vehicle, **changes)
