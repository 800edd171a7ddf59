import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Handover, Vehicle
from formation_gnc.control.hinf import HInfinityController, HinfParameters
from formation_gnc.control.mixed_sensitivity import WeightingFunction
from formation_gnc.errors import DesignError
from formation_gnc.orbit.constants import MU
from formation_gnc.relative.hill import HillModel

MINUTE = 60.0
GEO = CommonParameters(Orbit((MU / 7.2921e-5**2) ** (1.0 / 3.0)), tick=0.1 * MINUTE)
MASS = 1000.0  # kg; not given by Neokleous


def neokleous(bandwidth=1.0, steady=0.03, time=0.05, effort=1.5, shift=0.1, **changes):
    """Weights of the thesis, converted from 1 / min and min^2."""
    return HinfParameters(
        bandwidth=(bandwidth / MINUTE,) * 3,
        steady_error=(steady,) * 3,
        uncertainty_time=(time * MINUTE,) * 3,
        thrust=(MASS / (effort * MINUTE**2),) * 3,
        pole_shift=shift / MINUTE,
        **{"disturbance": 0.0, "gamma_margin": 0.05} | changes,
    )


def simulate(law, start, ticks, estimate, target, limit=np.inf, push=0.0):
    phi, gamma = HillModel(GEO.mean_motion).discretise(0.0, GEO.tick)
    states, forces = [np.asarray(start, dtype=float)], []
    for index in range(ticks):
        force = law.command(estimate(states[-1], index * GEO.tick, MASS), target(time=index * GEO.tick)).force
        forces.append(np.clip(force, -limit, limit))
        states.append(phi @ states[-1] + gamma @ (forces[-1] / MASS + push))
    return np.array(states), np.array(forces)


def vehicle(limit):
    return Vehicle(MASS, np.full(3, limit))


def test_neokleous_comparison_scenario(estimate, target):
    # 6.2: 100 m off in every axis, 100 N, within 10 cm after 100 minutes.
    law = HInfinityController(neokleous(), GEO, vehicle(100.0))
    states, forces = simulate(law, [100.0, 100.0, 100.0, 0.0, 0.0, 0.0], 1500, estimate, target)
    assert np.abs(states[1000:, :3]).max() < 0.1
    assert np.abs(forces).max() < 100.0
    assert 2.0 < law.optimal_gamma < 2.5  # and not below 1: the printed weights cannot all be met


@pytest.mark.parametrize(
    "parameters",
    [neokleous(shift=0.0, disturbance=1e-5), neokleous(10.0, 0.003, 0.1, shift=0.0, disturbance=1e-5)],
)
def test_every_channel_satisfies_its_bound_at_every_frequency(parameters):
    law = HInfinityController(parameters, GEO, vehicle(1.0))
    frequency = np.logspace(-7, 2, 400)
    values = law.problem.singular_values(law.continuous, frequency)
    performance, uncertainty = law.problem.performance.at(frequency), law.problem.uncertainty.at(frequency)
    # The channels are alike, so that the largest singular value of a product is the product.
    assert (values["S"].max(axis=1) * performance[:, 0]).max() <= law.gamma
    assert (values["T"].max(axis=1) * uncertainty[:, 0]).max() <= law.gamma
    assert (values["KS"].max(axis=1) * law.problem.effort[0]).max() <= law.gamma
    # Below the optimal gamma no controller satisfies all bounds: one of them is nearly attained.
    assert (values["S"].max(axis=1) * performance[:, 0]).max() > 0.5 * law.optimal_gamma


@pytest.mark.thorough
@pytest.mark.covers("Neokleous (5.20), (5.21)", "control/mixed_sensitivity.py")
def test_the_optimal_gamma_is_that_of_python_control():
    control = pytest.importorskip("control")
    problem = fresh("output").problem
    a, b2, c1, effort, disturbance = problem._scaled()
    b = np.hstack([disturbance * b2, np.eye(12)[:, 6:9], b2])
    d = np.zeros((12, 9))
    d[:3, 3:6], d[6:9, 6:], d[9:, 3:6] = np.diag(problem.performance.direct), np.diag(effort), np.eye(3)
    plant = control.ss(a, b, np.vstack([c1, np.zeros((3, 12)), np.eye(3, 12)]), d)
    _, _, theirs, _ = control.hinfsyn(plant, 3, 3)
    assert fresh("output").optimal_gamma == pytest.approx(theirs, rel=2e-3)  # accuracy of the bisection


def test_full_information_attains_its_gamma_for_an_acceleration():
    law = HInfinityController(neokleous(shift=0.0, disturbance=1e-5, form="full_information"), GEO, vehicle(1.0))
    b = np.vstack([np.zeros((3, 3)), np.eye(3)])
    loop, problem = law.continuous.closed_loop(law.problem.dynamics, b), law.problem
    feedback = np.hstack([law.continuous.d, law.continuous.c])
    worst = 0.0
    for w in np.logspace(-7, 1, 300):
        state = np.linalg.solve(1j * w * np.eye(12) - loop, np.vstack([b, np.zeros((6, 3))]) * problem.disturbance)
        performance, uncertainty = problem.performance, problem.uncertainty
        position = state[:3]
        stacked = np.vstack(
            [
                (performance.direct + performance.residue / (1j * w + performance.pole))[:, None] * position,
                (uncertainty.direct + uncertainty.residue / (1j * w + uncertainty.pole))[:, None] * position,
                problem.effort[:, None] * (feedback @ state),
            ]
        )
        worst = max(worst, np.linalg.norm(stacked, 2))
    assert 0.5 * law.optimal_gamma < worst <= law.gamma


@pytest.mark.covers("Neokleous (5.6)-(5.9)", "control/mixed_sensitivity.py")
def test_weighting_functions_have_their_named_asymptotes():
    one = np.ones(3)
    performance = WeightingFunction.performance(0.01 * one, 2.0 * one, 0.03 * one).at(np.array([1e-9, 0.01, 1e6]))[:, 0]
    np.testing.assert_allclose(performance[[0, 2]], [1.0 / 0.03, 0.5], rtol=1e-6)
    assert 1.0 < performance[1] < 1.2  # |w_P| is about 1 at the bandwidth
    uncertainty = WeightingFunction.uncertainty(50.0 * one, 0.3 * one, 2.0 * one).at(np.array([1e-9, 1e6]))[:, 0]
    np.testing.assert_allclose(uncertainty, [0.3, 2.0], rtol=1e-6)


LAWS = {
    form: HInfinityController(neokleous(shift=0.0, disturbance=1e-5, form=form), GEO, vehicle(1.0))
    for form in ("output", "full_information")
}


def fresh(form, limit=1.0):
    return HInfinityController(neokleous(shift=0.0, disturbance=1e-5, form=form), GEO, vehicle(limit))


@pytest.mark.parametrize("form", LAWS)
@settings(deadline=None)
@given(
    position=st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
    velocity=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
    force=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
)
def test_activation_starts_at_the_force_commanded_before(form, position, velocity, force, estimate, target):
    law = LAWS[form]
    law._states = None
    law.activate(Handover(np.array(force), "lqr"))
    command = law.command(estimate([*position, *velocity], mass=MASS), target())
    # Rounding of a sum with terms up to 1e4 times larger.
    np.testing.assert_allclose(command.force, force, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("form", LAWS)
@pytest.mark.covers("Neokleous 6.3, outlook", "control/hinf.py", "control/mpc.py")
def test_a_large_offset_with_small_thrusters_does_not_wind_up(form, estimate, target):
    # Neokleous 6.2.3: 1 km, 1 N.
    start = [1000.0, 1000.0, 1000.0, 0.0, 0.0, 0.0]
    states, forces = simulate(fresh(form), start, 4000, estimate, target, limit=1.0)
    assert 0.1 < np.abs(forces).max() <= 1.0  # off the limit
    assert np.abs(states[:, :3]).max() < 1200.0
    assert np.abs(states[-1, :3]).max() < 0.1


def fly_to_target(form, mass, known, estimate, target, common=GEO, ticks=2500):
    """Delta-v (m/s), time to 10 m (min) and largest distance from 1 km in every axis with 1 N.

    `known` is the thrust limit that the law knows.
    """
    parameters = dataclasses.replace(neokleous(shift=SHIFTS[form], **FORMS[form]), thrust=(mass / 5400.0,) * 3)
    law = HInfinityController(parameters, common, Vehicle(mass, np.full(3, known)))
    phi, gamma = HillModel(common.mean_motion).discretise(0.0, common.tick)
    state, spent, last, far = np.array([1000.0] * 3 + [0.0] * 3), 0.0, 0, 0.0
    for tick in range(ticks):
        force = law.command(estimate(state, tick * common.tick, mass), target(time=tick * common.tick)).force
        held = np.clip(force, -1.0, 1.0) / mass
        spent += np.abs(held).sum() * common.tick
        state = phi @ state + gamma @ held
        far = max(far, np.abs(state[:3]).max())
        last = tick if np.abs(state[:3]).max() > 10.0 else last
    return spent, (last + 1) * common.tick / 60.0, far


SHIFTS = {"shifted": 0.1, "regularised": 0.0, "full_information": 0.0}
FORMS = {
    "shifted": {},
    "regularised": {"disturbance": 1e-5},
    "full_information": {"disturbance": 1e-5, "form": "full_information"},
}
RESET = {50.0: (26.6, 12.0), 100.0: (26.3, 21.0), 300.0: (26.2, 50.0), 5000.0: (14.3, 250.0)}
"""By mass, the least delta-v and time that any form took with a reset of its states to the applied force."""


@pytest.mark.parametrize("mass", RESET)
@pytest.mark.parametrize("form", FORMS)
def test_recovery_is_better_than_clipping_and_resetting(form, mass, estimate, target):
    spent, settled, far = fly_to_target(form, mass, 1.0, estimate, target)
    clipped, late, _ = fly_to_target(form, mass, np.inf, estimate, target)
    assert spent < min(0.9 * clipped, 0.5 * RESET[mass][0])
    assert settled <= min(late, RESET[mass][1] + 0.1)  # within the tick
    assert far < 1001.0  # the start, in the first tick


@pytest.mark.parametrize("mass", [300.0, 1000.0])
def test_in_low_orbit_heavy_masses_return_within_twice_the_least(mass, estimate, target):
    """1 km above the target drifts by 38 km in a revolution: 1000 kg cannot be stopped with 1 N within 6 km.

    The linear programme for the least time takes 22 and 98 min, and 6.4 km with 1000 kg.
    """
    least, way = {300.0: (22.0, 1000.0), 1000.0: (98.0, 6400.0)}[mass]
    low = CommonParameters(Orbit(6978100.0), tick=6.0)
    spent, settled, far = fly_to_target("shifted", mass, 1.0, estimate, target, low, 2500)
    assert settled < 2.0 * least
    assert far < 2.5 * way
    assert spent < 7.0


def test_recovery_ends_where_an_unsaturated_loop_does(estimate, target):
    law = fresh("output")
    simulate(law, [1000.0] * 3 + [0.0] * 3, 4000, estimate, target, limit=1.0)
    assert law.recovery.state is None


def test_a_constant_disturbance_leaves_the_static_error_of_the_gain(estimate, target):
    law, push = fresh("output", limit=100.0), np.array([1e-5, -1e-5, 1e-5])
    states, _ = simulate(law, np.zeros(6), 3000, estimate, target, push=push)
    frequency = np.array([1e-9])
    static = HillModel(GEO.mean_motion).dynamics()
    k = law.continuous.c @ np.linalg.solve(-law.continuous.a, law.continuous.b)
    np.testing.assert_allclose(-(static[3:, :3] + k) @ states[-1, :3], push, rtol=1e-3)
    assert law.problem.singular_values(law.continuous, frequency)["S"].max() < law.gamma * 0.03


def test_the_same_parameters_give_the_same_law():
    np.testing.assert_array_equal(fresh("output").sampled.a, fresh("output").sampled.a)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pole_shift": 0.0, "disturbance": 0.0}, "poles on the imaginary axis"),
        ({"thrust": (1e12,) * 3}, r"no controller at any gamma for these weights \(none up to gamma"),
        (
            {"form": "full_information", "disturbance": 0.0},
            "disturbance is 0; it must be above zero",
        ),
        ({"bandwidth": (0.5, 0.5, 0.5), "thrust": (1e5, 1e5, 1e5)}, "sampled closed loop is unstable"),
    ],
)
def test_inadmissible_parameters_are_rejected_with_the_reason(changes, message):
    with pytest.raises(DesignError, match=message):
        HInfinityController(dataclasses.replace(neokleous(), **changes), GEO, vehicle(1.0))
