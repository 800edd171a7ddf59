"""Properties of every law in the registry, for any input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.registry import ALGORITHMS, FINITE_HORIZONS
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import load
from formation_gnc.relative.hill import HillModel
from formation_gnc.testing import laws
from formation_gnc.testing.laws import *  # noqa: F403 - the tests that any law inherits
from formation_gnc.testing.laws import CHIEF, STRONG, manager_of

algorithm = laws.laws_under_test(*ALGORITHMS)
pytest.mark.thorough(laws.test_the_thrust_is_finite_and_within_the_limit)

WITH_RADIAL_THRUST = ("hinf", "sliding_mode", "dynamic_inversion")

positions, velocities = (st.tuples(*[st.floats(-size, size)] * 3) for size in (1e3, 1.0))


@pytest.mark.parametrize("algorithm", FINITE_HORIZONS, scope="module")
@settings(max_examples=12)
@given(position=positions, velocity=velocities, goal=positions)
def test_a_feasible_reconfiguration_is_planned_and_followed(algorithm, position, velocity, goal, estimate, target):
    manager = manager_of(algorithm, thrust_limit=tuple(STRONG))
    for time, solver in ((0.0, "planned"), (10.0, "following")):
        seen, aim = estimate([*position, *velocity], time, chief=CHIEF), target([*goal, 0.0, 0.0, 0.0], time)
        thrust, status = manager.on_tick(seen, aim)
        assert (status.solver, status.fallback) == (solver, "")
        np.testing.assert_array_equal(thrust.force, status.demand)


@pytest.mark.parametrize("algorithm", sorted(ALGORITHMS.keys() - {"coast"}))
def test_a_thrust_limit_of_zero_is_rejected(algorithm):
    with pytest.raises(ValueError, match=r"thrust_limit: .* is not allowed; one axis must push"):
        manager_of(algorithm, thrust_limit=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("missing", ["x", "y", "z", "xy", "xz", "yz"])
@pytest.mark.thorough
def test_an_axis_without_thruster_is_designed_without_or_refused(algorithm, missing, estimate, target):
    """Along-track thrust alone controls the in-plane motion, radial thrust alone does not; three outputs take both."""
    limit = tuple(0.0 if each in missing else 0.01 for each in "xyz")
    weights = {}
    if issubclass(ALGORITHMS[algorithm].Parameters, QuadraticWeights):
        weights = {"position_error": (10.0,) * 3, "velocity_error": (0.1,) * 3, "thrust": (0.002,) * 3}
    own = {f"{algorithm}.{key}": value for key, value in weights.items()}
    if algorithm in FINITE_HORIZONS:
        own |= {f"{algorithm}.final_time": 5000.0, f"{algorithm}.step": 50.0, f"{algorithm}.replan_interval": 1000.0}
    values = {"chief.semi_major_axis": 6978100.0, "tick": 20.0, "thrust_limit": limit, "algorithm": algorithm} | own
    if algorithm != "coast" and ("y" in missing or ("x" in missing and algorithm in WITH_RADIAL_THRUST)):
        with pytest.raises(ConfigurationError, match=r"thrust_limit .* must be above 0"):
            ControllerManager("controller", load(ControllerParameters, values))
        return
    manager = ControllerManager("controller", load(ControllerParameters, values))
    model = HillModel(manager.parameters.mean_motion)
    state = np.array([5.0, -8.0, 2.0, 0.0, 0.0, 0.0])
    for tick in range(900):
        thrust, _ = manager.on_tick(estimate(state, 20.0 * tick, chief=CHIEF), target(time=20.0 * tick))
        state = model.propagate(0.0, state, 20.0, thrust.force / 100.0)
    if algorithm != "coast":
        assert np.linalg.norm(state[:2]) < 1.0
        assert "z" in missing or abs(state[2]) < 0.1
