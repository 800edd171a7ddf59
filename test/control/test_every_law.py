"""Properties of every law in the registry, for any input."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.registry import ALGORITHMS, FINITE_HORIZONS
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.parameters import load
from formation_gnc.records import EventKind
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS

CHIEF = state_from_elements(Elements(6978100.0, 0.0, 1.48, 0.0, 0.0, 0.0))
LIMIT = np.array([0.01, 0.02, 0.0])
"""N; one axis without thrust."""
STRONG = np.full(3, 50.0)
"""N; above the demand of a transfer of some kilometres in 300 s."""


def manager_of(algorithm: str, **values: Any) -> ControllerManager:
    basis = {"chief.semi_major_axis": 6978100.0, "tick": 10.0, "thrust_limit": tuple(LIMIT)}
    own = {key.replace("__", "."): value for key, value in values.items()}
    if algorithm in FINITE_HORIZONS:
        own[f"{algorithm}.final_time"] = 300.0  # short plans are cheap
    return ControllerManager("controller", load(ControllerParameters, {"algorithm": algorithm} | basis | own))


def arrays(shape: Any, size: float) -> st.SearchStrategy[Any]:
    """Arrays of flight-like values, or of any floats."""
    sane = hnp.arrays(float, shape, elements=st.floats(-size, size))
    return sane | hnp.arrays(float, shape, elements=st.floats(allow_nan=True, allow_infinity=True))


@st.composite
def ticks(draw: Any) -> dict[str, Any]:
    """Inputs of a tick."""
    sane = st.integers(0, 10_000 * NANOSECONDS)
    times = hnp.arrays(np.int64, (draw(st.integers(0, 2)), 2), elements=sane | st.integers(-(2**63), 2**63 - 1))
    return {
        "state": draw(arrays(6, 1e3)),
        "mass": draw(st.just(100.0) | st.floats(allow_nan=True, allow_infinity=True)),
        "chief": draw(st.just(CHIEF) | arrays(6, 1e7)),
        "goal": draw(arrays(6, 1e3)),
        "preview": draw(arrays((draw(st.integers(0, 3)), 6), 1e3)),
        "eclipses": draw(times),
        "neighbours": draw(arrays((draw(st.integers(0, 2)), 6), 1e3)),
    }


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@settings(max_examples=12)
@given(flight=st.lists(ticks(), min_size=1, max_size=4), limit=st.sampled_from([LIMIT, STRONG]))
@pytest.mark.thorough
def test_the_thrust_is_finite_and_within_the_limit(algorithm, flight, limit, estimate, target):
    mpc = {"mpc__keep_out_radius": 20.0, "mpc__off_in_eclipse": True, "mpc__horizon": 40}
    manager = manager_of(algorithm, thrust_limit=tuple(limit), **mpc)
    for tick, each in enumerate(flight):
        seen = estimate(each["state"], 10.0 * tick, each["mass"], each["chief"])
        aim = target(
            each["goal"],
            10.0 * tick,
            each["preview"],
            neighbours=each["neighbours"],
        )
        aim.eclipses = each["eclipses"]
        thrust, status = manager.on_tick(seen, aim)
        assert np.isfinite(thrust.force).all()
        assert (np.abs(thrust.force) <= limit).all()
        assert np.isfinite(status.demand).all()
        if not np.isfinite(each["state"]).all():
            assert not thrust.force.any()
            assert status.fallback == "estimate not finite: no thrust"


positions, velocities = (st.tuples(*[st.floats(-size, size)] * 3) for size in (1e3, 1.0))


@pytest.mark.parametrize("algorithm", FINITE_HORIZONS)
@settings(max_examples=12)
@given(position=positions, velocity=velocities, goal=positions)
def test_a_feasible_reconfiguration_is_planned_and_followed(algorithm, position, velocity, goal, estimate, target):
    manager = manager_of(algorithm, thrust_limit=tuple(STRONG))
    for time, solver in ((0.0, "planned"), (10.0, "following")):
        seen, aim = estimate([*position, *velocity], time, chief=CHIEF), target([*goal, 0.0, 0.0, 0.0], time)
        thrust, status = manager.on_tick(seen, aim)
        assert (status.solver, status.fallback) == (solver, "")
        np.testing.assert_array_equal(thrust.force, status.demand)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_the_law_recovers_after_invalid_inputs(algorithm, estimate, target):
    manager, state = manager_of(algorithm, mpc__thrust_rate=1e-4), np.array([5.0, -8.0, 0.0, 0.0, 0.0, 0.0])
    huge = np.array([1e308, -1e308, 1e308, -1e308, 1e308, -1e308])
    bad = [np.full(6, np.nan), np.full(6, np.inf), huge, np.full(6, 1e200), np.full(6, 1e15)]
    for tick, wrong in enumerate([*bad, *bad, *[state] * 20]):
        mass = np.nan if tick < len(bad) else 100.0
        seen = estimate(wrong, 10.0 * tick, mass, CHIEF)
        thrust, _ = manager.on_tick(seen, target(time=10.0 * tick))
    assert thrust.force.any() == (algorithm != "coast")


@pytest.mark.parametrize("mass", [-100.0, 0.0, np.inf, np.nan])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_an_invalid_mass_gives_no_thrust_and_the_law_recovers(algorithm, mass, estimate, target):
    """Force is mass times acceleration: a negative mass would reverse the thrust of every law."""
    manager, away = manager_of(algorithm), [5.0, -8.0, 0.0, 0.0, 0.0, 0.0]
    reason = f"mass is {mass:g} kg; it must be positive and finite: no thrust"
    for time in (0.0, 10.0):
        thrust, status = manager.on_tick(estimate(away, time, mass, CHIEF), target(time=time))
        assert not thrust.force.any()
        assert status.fallback == reason
    thrust, _ = manager.on_tick(estimate(away, 20.0, chief=CHIEF), target(time=20.0))
    assert thrust.force.any() == (algorithm != "coast")
    first, over = [event for event in manager.take_events() if event.kind == EventKind.FALLBACK]
    assert (first.detail, over.time) == (reason, 20 * NANOSECONDS)


@pytest.mark.parametrize("algorithm", sorted(ALGORITHMS.keys() - {"coast"}))
def test_a_thrust_limit_of_zero_is_rejected(algorithm):
    with pytest.raises(ValueError, match=r"thrust_limit: .* is not allowed; one axis must push"):
        manager_of(algorithm, thrust_limit=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("missing", ["x", "y", "z", "xy", "xz", "yz"])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.thorough
def test_an_axis_without_thruster_is_designed_without_or_refused(algorithm, missing, estimate, target):
    """Along-track thrust alone controls the in-plane motion, radial thrust alone does not."""
    limit = tuple(0.0 if each in missing else 0.01 for each in "xyz")
    weights = {}
    if issubclass(ALGORITHMS[algorithm].Parameters, QuadraticWeights):
        weights = {"position_error": (10.0,) * 3, "velocity_error": (0.1,) * 3, "thrust": (0.002,) * 3}
    own = {f"{algorithm}.{key}": value for key, value in weights.items()}
    if algorithm in FINITE_HORIZONS:
        own |= {f"{algorithm}.final_time": 5000.0, f"{algorithm}.step": 50.0, f"{algorithm}.replan_interval": 1000.0}
    values = {"chief.semi_major_axis": 6978100.0, "tick": 20.0, "thrust_limit": limit, "algorithm": algorithm} | own
    if algorithm != "coast" and ("y" in missing or ("x" in missing and algorithm == "hinf")):
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
