"""Tests of a control law, for any law: the module of a plug-in's tests inherits them.

    from formation_gnc.testing.laws import *
    algorithm = laws_under_test("own_law")

The law must be in the registry: built in, or installed as a plug-in.
"""

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import ArrayLike

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.registry import FINITE_HORIZONS
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.parameters import load
from formation_gnc.records import NO_ECLIPSES, NO_NEIGHBOURS, EventKind, NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector

__all__ = [
    "laws_under_test",
    "test_a_flight_is_reproducible_bit_for_bit",
    "test_an_invalid_mass_gives_no_thrust_and_the_law_recovers",
    "test_swaps_to_the_law_and_back_are_bumpless",
    "test_the_law_recovers_after_invalid_inputs",
    "test_the_thrust_is_finite_and_within_the_limit",
]

CHIEF = state_from_elements(Elements(6978100.0, 0.0, 1.48, 0.0, 0.0, 0.0))
LIMIT = np.array([0.01, 0.02, 0.0])
"""N; one axis without thrust."""
STRONG = np.full(3, 50.0)
"""N; above the demand of a transfer of some kilometres in 300 s."""


def manager_of(algorithm: str, **values: Any) -> ControllerManager:
    """Controller with a law on a low orbit at ticks of 10 s; `__` in names of parameters stands for a dot."""
    basis = {"chief.semi_major_axis": 6978100.0, "tick": 10.0, "thrust_limit": tuple(LIMIT)}
    own = {key.replace("__", "."): value for key, value in values.items()}
    own |= {f"{name}.final_time": 300.0 for name in FINITE_HORIZONS}  # short plans are cheap
    return ControllerManager("controller", load(ControllerParameters, {"algorithm": algorithm} | basis | own))


def estimate_of(
    state: ArrayLike, time: float = 0.0, mass: float = 100.0, chief: Vector | None = None
) -> NavigationState:
    """Estimate of a relative state (6,), m and m/s, at a time (s)."""
    return NavigationState(
        time=round(time * NANOSECONDS),
        relative_state=np.asarray(state, dtype=float),
        chief_state=np.zeros(6) if chief is None else chief,
        mass=mass,
    )


def target_of(
    state: ArrayLike | None = None,
    time: float = 0.0,
    preview: Vector | None = None,
    step: float = 60.0,
    eclipses: Any = NO_ECLIPSES,
    neighbours: Matrix = NO_NEIGHBOURS,
) -> Target:
    """Target at a time (s), optionally with preview, eclipses (s) and neighbours."""
    return Target(
        round(time * NANOSECONDS),
        "leader_follower",
        np.zeros(6) if state is None else np.asarray(state, dtype=float),
        round(step * NANOSECONDS),
        np.empty((0, 6)) if preview is None else preview,
        np.rint(eclipses * NANOSECONDS).astype(np.int64),
        neighbours,
    )


def laws_under_test(*algorithms: str) -> Any:
    """Fixture with each of these laws in turn, by their names in the registry."""

    @pytest.fixture(params=algorithms, scope="module", name="algorithm")
    def algorithm(request: pytest.FixtureRequest) -> Any:
        return request.param

    return algorithm


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


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])  # on a busy machine
@given(flight=st.lists(ticks(), min_size=1, max_size=4), limit=st.sampled_from([LIMIT, STRONG]))
def test_the_thrust_is_finite_and_within_the_limit(algorithm: str, flight: list[dict[str, Any]], limit: Vector) -> None:
    """Whatever a law is given, also NaN and absurd values; an estimate that is not finite gives no thrust."""
    mpc = {"mpc__keep_out_radius": 20.0, "mpc__off_in_eclipse": True, "mpc__horizon": 40}
    manager = manager_of(algorithm, thrust_limit=tuple(limit), **mpc)
    for tick, each in enumerate(flight):
        seen = estimate_of(each["state"], 10.0 * tick, each["mass"], each["chief"])
        aim = target_of(
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


def test_the_law_recovers_after_invalid_inputs(algorithm: str) -> None:
    """What was absurd leaves no trace in the law's state: it pushes again."""
    manager, state = manager_of(algorithm, mpc__thrust_rate=1e-4), np.array([5.0, -8.0, 0.0, 0.0, 0.0, 0.0])
    huge = np.array([1e308, -1e308, 1e308, -1e308, 1e308, -1e308])
    bad = [np.full(6, np.nan), np.full(6, np.inf), huge, np.full(6, 1e200), np.full(6, 1e15)]
    pushed = []
    for tick, wrong in enumerate([*bad, *bad, *[state] * 20]):
        mass = np.nan if tick < len(bad) else 100.0
        seen = estimate_of(wrong, 10.0 * tick, mass, CHIEF)
        thrust, _ = manager.on_tick(seen, target_of(time=10.0 * tick))
        pushed.append(bool(thrust.force.any()))
    # A law that plans burns pushes when they are due, not at every tick.
    assert any(pushed[2 * len(bad) :]) == (algorithm != "coast")


@pytest.mark.parametrize("mass", [-100.0, 0.0, np.inf, np.nan])
def test_an_invalid_mass_gives_no_thrust_and_the_law_recovers(algorithm: str, mass: float) -> None:
    """Force is mass times acceleration: a negative mass would reverse the thrust of every law."""
    manager, away = manager_of(algorithm), [5.0, -8.0, 0.0, 0.0, 0.0, 0.0]
    reason = f"mass is {mass:g} kg; it must be positive and finite: no thrust"
    for time in (0.0, 10.0):
        thrust, status = manager.on_tick(estimate_of(away, time, mass, CHIEF), target_of(time=time))
        assert not thrust.force.any()
        assert status.fallback == reason
    thrust, _ = manager.on_tick(estimate_of(away, 20.0, chief=CHIEF), target_of(time=20.0))
    assert thrust.force.any() == (algorithm != "coast")
    first, over = [event for event in manager.take_events() if event.kind == EventKind.FALLBACK]
    assert (first.detail, over.time) == (reason, 20 * NANOSECONDS)


def fly(algorithm: str, swaps: dict[int, str], ticks: int = 120) -> tuple[Matrix, Vector]:
    """Forces (ticks, 3) and last state (6,) of a flight from some metres off under Hill's equations.

    Args:
        algorithm: law at the start.
        swaps: law by the tick from which it flies.
        ticks: of 10 s.
    """
    manager = manager_of(algorithm, thrust_limit=(0.01,) * 3)
    model = HillModel(manager.parameters.mean_motion)
    state, forces = np.array([5.0, -8.0, 3.0, 0.0, 0.0, 0.0]), []
    for tick in range(ticks):
        if tick in swaps:
            manager.commit(manager.stage({"algorithm": swaps[tick]}))
        thrust, status = manager.on_tick(estimate_of(state, 10.0 * tick, chief=CHIEF), target_of(time=10.0 * tick))
        assert (type(status.solver), type(status.fallback)) == (str, str)
        assert isinstance(status.iterations, int)
        forces.append(thrust.force)
        state = model.propagate(0.0, state, 10.0, thrust.force / 100.0)
    return np.array(forces), state


def test_a_flight_is_reproducible_bit_for_bit(algorithm: str) -> None:
    """The same inputs give the same forces, also from a law that has flown elsewhere before."""
    np.testing.assert_array_equal(fly(algorithm, {})[0], fly(algorithm, {})[0])


def test_swaps_to_the_law_and_back_are_bumpless(algorithm: str) -> None:
    """No step in force at a handover beyond `handover_step`, a tenth of the limit."""
    forces, _ = fly("lqr", {40: algorithm, 80: "lqr"})
    for tick in (40, 80):
        assert (np.abs(forces[tick] - forces[tick - 1]) <= 0.1 * 0.01 * (1.0 + 1e-9)).all()
