import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra import numpy as hnp
from scipy.optimize import lsq_linear

from formation_gnc.control.autopilot import Autopilot, ControllerParameters
from formation_gnc.control.controller import Handover, Vehicle
from formation_gnc.control.mpc import ModelPredictiveController, MpcParameters
from formation_gnc.control.programme import facet_normals, facet_reach
from formation_gnc.errors import DesignError
from formation_gnc.mission import Mission, Orbit
from formation_gnc.parameters import load
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

ROBERTS = MpcParameters(position_error=(10.0,) * 3, velocity_error=(0.1,) * 3, thrust=(0.002,) * 3)
OFFSET = [10.0, 10.0, 10.0, 0.0, 0.0, 0.0]


def make(mission, vehicle, **changes):
    return ModelPredictiveController(dataclasses.replace(ROBERTS, **changes), mission, vehicle)


def fly(law, model, estimate, target, start, ticks, tick=10.0, mass=100.0, dark=None):
    states, commands = [np.asarray(start, dtype=float)], []
    for index in range(ticks):
        time = index * tick
        seen = estimate(states[-1], time, mass)
        seen.eclipse = bool(dark and dark(time))
        commands.append(law.command(seen, target(time=time)))
        phi, gamma = model.discretise(time, tick)
        states.append(phi @ states[-1] + gamma @ (commands[-1].force / mass))
    return np.array(states), np.array([command.force for command in commands]), commands


def test_without_active_limits_it_is_the_lqr(mission, vehicle, estimate, target):
    law = make(mission, vehicle, step=10.0)
    for state in (OFFSET, [0, 5, 0, 0.01, 0, 0], [-3, 0, 8, 0, -0.01, 0.01]):
        expected = law.reserve.command(estimate(state), target()).force
        law._plan = np.empty((0, 3))
        # What the solver's accuracy leaves: 1e-4 of the thrust limit, times some tens for the flat directions
        # of the cost.
        np.testing.assert_allclose(
            law.command(estimate(state), target()).force, expected, rtol=0.0, atol=3e-5
        )


def test_matrices_in_place_of_bryson_weights(mission, vehicle, estimate, target):
    matrices = MpcParameters(
        state_weight=tuple(np.diag([0.01] * 3 + [100.0] * 3).ravel()),
        thrust_weight=tuple((np.eye(3) / 0.002**2).ravel()),
    )
    ours, theirs = (
        law.command(estimate(OFFSET), target()).force
        for law in (make(mission, vehicle), ModelPredictiveController(matrices, mission, vehicle))
    )
    np.testing.assert_allclose(ours, theirs, rtol=1e-6)


@pytest.mark.parametrize("weighting", ["running", "terminal"])
def test_the_plan_is_the_optimum_within_the_limits(weighting, mission, vehicle, estimate, target):
    law = make(mission, vehicle, weighting=weighting, position_error=(1.0,) * 3, velocity_error=(0.01,) * 3)
    state = np.array([40.0, -60.0, 30.0, 0.02, 0.0, 0.01])
    law.command(estimate(state), target())
    # The same as bounded least squares, from the programme's own weights but by another method.
    programme = law._programmes[0]
    roots = np.array([np.linalg.cholesky(weight + 1e-18 * np.eye(6)).T for weight in programme.weight])
    rows = np.vstack(
        [(roots @ programme.forced.reshape(30, 6, 90)).reshape(180, 90), np.eye(90) * (1.0 / 0.002 * 0.01)]
        if weighting == "terminal"
        else [
            (roots @ programme.forced.reshape(30, 6, 90)).reshape(180, 90),
            np.eye(90) * (6.0**0.5 / 0.002 * 0.01),
        ]
    )
    goal = -(roots @ (programme.free @ state).reshape(30, 6, 1)).ravel()
    best = lsq_linear(rows, np.concatenate([goal, np.zeros(90)]), (-1.0, 1.0), tol=1e-14, max_iter=500).x
    assert np.abs(best).max() > 0.999  # limits are active
    ours = law._plan.ravel() / 0.01
    excess = np.linalg.norm(rows @ ours - np.concatenate([goal, np.zeros(90)])) ** 2
    least = np.linalg.norm(rows @ best - np.concatenate([goal, np.zeros(90)])) ** 2
    assert excess <= least * (1.0 + 1e-3)
    np.testing.assert_allclose(ours[:3], best[:3], atol=0.02)


def test_an_offset_is_recovered_and_the_thrust_limit_is_used(mission, vehicle, estimate, target):
    states, forces, _ = fly(
        make(mission, vehicle), HillModel(mission.mean_motion), estimate, target, [60, 60, 60, 0, 0, 0], 900
    )
    assert np.abs(forces).max() == pytest.approx(0.01, rel=1e-3)
    assert np.abs(forces).max() <= 0.01
    assert np.linalg.norm(states[-1, :3]) < 0.1


def test_an_eccentric_chief_is_followed_on_its_own_model(vehicle, estimate, target):
    mission = Mission(Orbit(1.0e7, eccentricity=0.3), tick=20.0)
    law = make(mission, vehicle, model="tschauner_hempel")
    states, _, commands = fly(
        law, TschaunerHempelModel(KeplerChief(1.0e7, 0.3)), estimate, target, OFFSET, 500, tick=20.0
    )
    assert np.linalg.norm(states[-1, :3]) < 0.01
    assert not any(command.fallback for command in commands)


@settings(deadline=None)
@given(hnp.arrays(float, 3, elements={"min_value": -2.0, "max_value": 2.0}))
def test_the_total_thrust_polyhedron_lies_inside_the_sphere(point):
    if (np.abs(facet_normals() @ point) <= 1.0 / facet_reach()).all():
        assert np.linalg.norm(point) <= 1.0 + 1e-12
    assert facet_normals().shape == (13, 3)
    assert facet_reach() < 1.15  # and it wastes little


def test_total_thrust_and_its_rate_are_kept(mission, vehicle, estimate, target):
    law = make(mission, vehicle, total_thrust=0.01, thrust_rate=5e-5)
    states, forces, _ = fly(law, HillModel(mission.mean_motion), estimate, target, [60, 60, 60, 0, 0, 0], 900)
    assert np.linalg.norm(forces, axis=1).max() <= 0.01 * (1.0 + 1e-12)
    assert np.linalg.norm(forces, axis=1).max() > 0.0085
    steps = np.abs(np.diff(np.vstack([np.zeros(3), forces]), axis=0))
    assert steps.max() <= 5e-4 * (1.0 + 1e-3)  # the total limit goes first
    assert np.linalg.norm(states[-1, :3]) < 0.5


def test_no_thrust_in_kremmydas_eclipse(mission, vehicle, estimate, target):
    law = make(mission, vehicle, eclipse="share", horizon=50)
    states, forces, _ = fly(
        law, HillModel(mission.mean_motion), estimate, target, [60, 60, 60, 0, 0, 0], 1700
    )
    period = 2.0 * np.pi / mission.mean_motion
    begins, ends = 10.0 * np.arange(1700), 10.0 * np.arange(1, 1701)
    dark = (begins % period >= 2.0 / 3.0 * period) | (ends // period > begins // period)
    assert not forces[dark].any()
    assert np.abs(forces[~dark]).max() > 0.009
    assert np.linalg.norm(states[-1, :3]) < 0.2


def test_the_shadow_that_was_met_is_expected_an_orbit_later(mission, vehicle, estimate, target):
    period = 2.0 * np.pi / mission.mean_motion
    law = make(mission, vehicle, eclipse="observed", horizon=50)

    def dark(time):
        return 0.2 * period <= time % period < 0.5 * period

    _, forces, _ = fly(
        law, HillModel(mission.mean_motion), estimate, target, [200, 60, 60, 0, 0, 0], 1100, dark=dark
    )
    times = 10.0 * np.arange(1100)
    inside = np.array([dark(time + 10.0) or dark(time) for time in times])
    second = (times > period) & inside
    # One tick late at its end: the flag was first seen off at the tick after.
    assert np.abs(forces[second]).max() < 1e-12
    assert np.abs(forces[(times > period) & ~inside]).max() > 1e-4
    heir = make(mission, vehicle, eclipse="observed", horizon=50)
    heir.take_over(Handover(forces[-1], "mpc", law))
    assert heir._night.seen == law._night.seen


def test_one_solve_serves_the_replan_interval(mission, vehicle, estimate, target):
    law = make(mission, vehicle, replan_interval=600.0)
    _, forces, commands = fly(law, HillModel(mission.mean_motion), estimate, target, OFFSET, 180)
    assert [index for index, command in enumerate(commands) if command.iterations] == [0, 60, 120]
    held = forces.reshape(30, 6, 3)
    np.testing.assert_array_equal(held, held[:, :1].repeat(6, axis=1))


# Kremmydas' NetSat: 1.5 kg, 8 uN, 240 s, two thirds of an orbit with thrust. His axes are along, across,
# down.
NETSAT = Mission(Orbit(7078137.0), tick=240.0)


def netsat(weight):
    """His terminal weight, squared, over scales of 2, 4 and 2 m, their rates and 2e-7 m/s^2 (listing of
    netSATmpc)."""
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


@pytest.mark.parametrize(("weight", "least", "most"), [(1.7, 10.0, 400.0), (17.0, 0.0, 1.0)])
def test_kremmydas_multistep_converges_to_a_moving_target(weight, least, most, estimate, target):
    model, rate = HillModel(NETSAT.mean_motion), NETSAT.mean_motion
    law = ModelPredictiveController(netsat(weight), NETSAT, Vehicle(1.5, np.full(3, 8e-6)))

    def ellipse(size, across, time):
        sine, cosine = np.sin(rate * time), np.cos(rate * time)
        place = np.array([size * sine, 2.0 * size * cosine, across * sine])
        return np.concatenate([place, rate * np.array([size * cosine, -2.0 * size * sine, across * cosine])])

    state, errors = ellipse(1000.0, 800.0, 0.0), []
    for index in range(2500):
        time = 240.0 * index
        force = law.command(
            estimate(state, time, 1.5), target(ellipse(1000.0, 0.0, time + 900.0), time)
        ).force
        assert np.abs(force).max() <= 8e-6
        state = model.propagate(0.0, state, 240.0, force / 1.5)
        errors.append(np.linalg.norm((state - ellipse(1000.0, 0.0, time + 1140.0))[:3]))
    assert max(errors[:25]) > 800.0
    # After 100 orbits: the printed weight leaves tens to hundreds of metres, ten times it less than one.
    assert least < max(errors[-25:]) < most


def test_absolute_cost_takes_less_delta_v(mission, vehicle, estimate, target):
    used = {}
    for cost in ("quadratic", "absolute"):
        law = make(
            mission, vehicle, cost=cost, weighting="terminal", horizon=60, position_error=(0.1,) * 3,
            velocity_error=(1e-4,) * 3, thrust=(0.01,) * 3, replan_interval=3600.0,
        )  # fmt: skip
        states, forces, _ = fly(law, HillModel(mission.mean_motion), estimate, target, OFFSET, 360)
        assert np.linalg.norm(states[-1, :3]) < 0.5
        used[cost] = np.abs(forces).sum()
    assert used["absolute"] < 0.9 * used["quadratic"]


def test_the_keep_out_sphere_is_flown_round(mission, vehicle, estimate, target):
    closest = {}
    for radius in (0.0, 40.0):
        law = make(mission, vehicle, keep_out_radius=radius)
        start, aim = [0.0, 60.0, 1.0, 0.0, 0.0, 0.0], np.array([0.0, -60.0, 0.0, 0.0, 0.0, 0.0])
        states = [np.array(start)]
        for index in range(600):
            command = law.command(estimate(states[-1], 10.0 * index), target(aim, 10.0 * index))
            states.append(
                HillModel(mission.mean_motion).propagate(0.0, states[-1], 10.0, command.force / 100.0)
            )
        closest[radius] = np.linalg.norm(np.array(states)[:, :3], axis=1).min()
        assert np.linalg.norm(states[-1][:3] - aim[:3]) < 3.0
    assert closest[0.0] < 30.0
    assert closest[40.0] > 38.0  # it is soft


def test_a_preview_is_followed_as_far_as_it_reaches(mission, vehicle, estimate, target):
    law, other = make(mission, vehicle), make(mission, vehicle)
    drifting = np.tile([30.0, 0.0, 0.0, 0.0, 0.0, 0.0], (30, 1))
    with_preview = law.command(estimate(np.zeros(6)), target(np.zeros(6), preview=drifting)).force
    assert with_preview[0] > 1e-3
    wrong_step = other.command(estimate(np.zeros(6)), target(np.zeros(6), preview=drifting, step=10.0)).force
    assert np.abs(wrong_step).max() < 1e-6


def test_what_cannot_be_solved_flies_the_last_plan_and_then_lqr(mission, vehicle, estimate, target):
    law = make(mission, vehicle, eclipse="share", thrust_rate=1e-6, horizon=50)
    law.take_over(Handover(np.full(3, 0.01), "coast"))
    first = law.command(estimate(OFFSET, 3500.0), target(time=3500.0))
    assert first.fallback.startswith(
        "mpc: primal infeasible"
    )  # 350 s are too short to bring 10 mN down to none
    assert first.fallback.endswith("no plan, LQR flies")
    np.testing.assert_allclose(first.force, law.reserve.command(estimate(OFFSET), target()).force)
    good = make(mission, vehicle)
    planned = good.command(estimate(OFFSET), target())
    lost = good.command(estimate(1e200 * np.ones(6), 10.0), target(time=10.0))
    assert lost.fallback == "mpc: the error is out of any range; the last plan flies"
    np.testing.assert_array_equal(lost.force, planned.force)
    again = good.command(estimate(OFFSET, 20.0), target(time=20.0))
    assert not again.fallback


@settings(deadline=None)
@given(states=hnp.arrays(float, (4, 6), elements={"min_value": -1e12, "max_value": 1e12}))
def test_any_sequence_of_estimates_gets_bounded_commands(states, estimate, target):
    values = {"chief.semi_major_axis": 6978100.0, "tick": 10.0, "algorithm": "mpc", "mpc.horizon": 6}
    pilot = Autopilot("controller", load(ControllerParameters, values))
    for tick, state in enumerate(states):
        thrust, _ = pilot.on_tick(estimate(state, 10.0 * tick), target(time=10.0 * tick))
        assert (np.abs(thrust.force) <= 0.01).all()


def test_equal_inputs_give_equal_bits(mission, vehicle, estimate, target):
    flights = [
        fly(
            make(mission, vehicle),
            HillModel(mission.mean_motion),
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
        ({"control_horizon": 31}, "control_horizon is 31 steps; it must be at most horizon, 30"),
        ({"eclipse": "share"}, "is not longer than the eclipse"),
        ({"eclipse": "observed"}, "is not longer than the eclipse"),
        (
            {"state_weight": tuple(-np.eye(6).ravel())},
            "mpc, in reserve lqr: the state weight has a normalised",
        ),
    ],
)
def test_inadmissible_parameters_are_refused_with_the_reason(changes, message, mission, vehicle):
    with pytest.raises(DesignError, match=message):
        make(mission, vehicle, **changes)
