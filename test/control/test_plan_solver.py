"""Every plan that counts as solved is the optimum of its QP, whatever the scale of its costs."""

import numpy as np
import osqp
import pytest
from scipy import sparse
from scipy.optimize import linprog

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.mpc import ModelPredictiveController, MpcParameters
from formation_gnc.control.plan_solver import OPTIMALITY, PlanSolver, SolverError
from formation_gnc.control.quadratic_programme import QuadraticProgramme

MASS = 100.0


def recorded(monkeypatch):
    """The QPs that are solved from now on, in a list."""
    programmes, within_bounds = [], PlanSolver._within_bounds

    def record(self, programme: QuadraticProgramme):
        programmes.append(programme)
        return within_bounds(self, programme)

    monkeypatch.setattr(PlanSolver, "_within_bounds", record)
    return programmes


def exact(programme):
    """Cost of the optimum: OSQP, from residuals of 1e-10 polished on its active set; NaN if it does not get there."""
    solver, offset = osqp.OSQP(), programme.offset
    upper = sparse.block_diag(
        [sparse.coo_array(np.triu(programme.hessian)), sparse.diags_array(programme.slack_hessian)]
        if len(programme.slack_hessian)
        else [sparse.coo_array(np.triu(programme.hessian))]
    )
    solver.setup(
        sparse.csc_matrix(upper), programme.linear, sparse.csc_matrix(programme.rows), programme.lower, programme.upper,
        verbose=False, eps_abs=1e-10, eps_rel=1e-10, max_iter=20_000, polishing=True, check_dualgap=False,
    )  # fmt: skip
    result = solver.solve(raise_error=False)
    return result.info.obj_val + offset if result.info.status_val == osqp.SolverStatus.OSQP_SOLVED else np.nan


def random_case(random):
    """A law with any cost, weighting and constraints, and a state from centimetres to a kilometre off."""
    unit, horizon = 10.0 ** random.uniform(-3.0, -1.0), int(random.integers(3, 40))
    some = {
        "total_thrust": unit * random.uniform(0.5, 1.2),
        "thrust_rate": unit / 60.0 * random.uniform(0.1, 1.0),
        "keep_out_radius": random.uniform(5.0, 50.0),
        "control_horizon": int(random.integers(1, horizon + 1)),
    }
    parameters = MpcParameters(
        horizon=horizon,
        cost=str(random.choice(["quadratic", "absolute"])),
        weighting=str(random.choice(["running", "terminal"])),
        position_error=(10.0 ** random.uniform(-1.0, 1.5),) * 3,
        velocity_error=(10.0 ** random.uniform(-3.5, -1.0),) * 3,
        thrust=(unit * 10.0 ** random.uniform(-1.0, 0.3),) * 3,
        **{name: value for name, value in some.items() if random.random() < 0.3},
    )
    common = CommonParameters(Orbit(random.uniform(6.8e6, 4.2e7)), tick=60.0)
    law = ModelPredictiveController(parameters, common, Vehicle(MASS, np.full(3, unit)))
    size = 10.0 ** random.uniform(-2.0, 3.0)
    return law, size * random.standard_normal(6) * np.repeat([1.0, 1e-3 * random.random()], 3)


@pytest.mark.parametrize("seed", range(4))
def test_a_solved_plan_costs_what_the_optimum_costs(seed, monkeypatch, estimate, target):
    random, solved = np.random.default_rng(seed), 0
    programmes = recorded(monkeypatch)
    for _ in range(10):
        law, state = random_case(random)
        programmes.clear()
        command = law.command(estimate(state, mass=MASS), target())
        if command.solver != "solved":
            continue
        programme, least = programmes[0], exact(programmes[0])
        cost = 0.5 * command.cost * law.qps[0].scale
        assert programme.cost(np.zeros(len(programme.linear))) == programme.offset
        if np.isfinite(least):
            solved += 1
            # The reference is itself exact to 1e-8 of the cost of free motion.
            assert cost <= least * (1.0 + 2.0 * OPTIMALITY) + 1e-8 * programme.offset
            assert cost >= least * (1.0 - 2.0 * OPTIMALITY) - 1e-8 * programme.offset
    assert solved >= 6


def test_the_least_delta_v_is_found_beside_a_large_error(estimate, target):
    """The errors cost ten thousand times what the thrust does: residuals alone do not see the thrust."""
    unit, state = 0.02, np.array([60.0, -300.0, 200.0, 0.0, 0.0, 0.0])
    parameters = MpcParameters(
        horizon=97, weighting="terminal", cost="absolute", thrust=(unit,) * 3,
        position_error=(1.0,) * 3, velocity_error=(1e-3,) * 3,
    )  # fmt: skip
    law = ModelPredictiveController(
        parameters, CommonParameters(Orbit(6978100.0), tick=60.0), Vehicle(MASS, np.full(3, unit))
    )
    command = law.command(estimate(state, mass=MASS), target())
    assert command.solver == "solved"
    forces = law.plan.ravel() / unit
    qp = law.qps[0]
    end = qp.forced[-6:]
    # The same end with the least thrust is a linear programme.
    end = end / np.repeat([1.0, 1e-3], 3)[:, None]
    least = linprog(np.ones(2 * len(forces)), A_eq=np.hstack([end, -end]), b_eq=end @ forces, bounds=(0.0, 1.0))
    assert least.status == 0
    assert np.abs(forces).sum() <= 1.01 * least.fun
    assert np.abs(law.plan).sum() * 60.0 / MASS == pytest.approx(0.487, abs=0.001)  # m/s


def test_a_plan_within_all_limits_is_exact(common, vehicle, estimate, target):
    law = ModelPredictiveController(MpcParameters(step=10.0), common, vehicle)
    for time, size in enumerate((1e-6, 1e-3, 0.1)):
        seen, aim = estimate(size * np.array([1.0, -2.0, 3.0, 1e-3, 0.0, -1e-3]), time), target(time=time)
        command, free = law.command(seen, aim), law.fallback_law.command(seen, aim)
        assert (command.solver, command.iterations) == ("solved", 1)
        # The horizon's cost-to-go by doubling, and the condensed Hessian, each to rounding error.
        np.testing.assert_allclose(command.force, free.force, rtol=0.0, atol=1e-6 * np.abs(free.force).max())


def test_a_linear_cost_at_the_target_asks_for_nothing(common, vehicle, estimate, target):
    law = ModelPredictiveController(MpcParameters(cost="absolute"), common, vehicle)
    command = law.command(estimate(np.zeros(6)), target())
    assert command.solver == "solved"
    assert np.abs(command.force).max() <= 1e-6 * vehicle.thrust_limit.max()


def test_a_plan_that_cannot_be_is_not_called_solved(common, vehicle, estimate, target):
    law = ModelPredictiveController(MpcParameters(), common, vehicle)
    bounds = law.solver._bounds

    def contradicting(inputs):
        result = bounds(inputs)
        result.lower, result.upper = result.lower.copy(), result.upper.copy()
        result.lower[0] = result.upper[0] + 1.0
        return result

    law.solver._bounds = contradicting
    with pytest.raises((SolverError, ValueError)):
        law._solve(estimate([60.0] * 3 + [0.0] * 3), target())
