from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from formation_gnc.control.controller import Command, Controller
from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import load
from formation_gnc.records import EventKind

VALUES = {"chief.semi_major_axis": 6978100.0, "tick": 10.0, "lqr.thrust": (0.002, 0.002, 0.002)}
AWAY = np.array([50.0, -20.0, 10.0, 0.0, 0.0, 0.0])


def manager_of(**values: Any) -> ControllerManager:
    return ControllerManager(
        "controller",
        load(ControllerParameters, VALUES | {k.replace("__", "."): v for k, v in values.items()}),
    )


class Scripted(Controller[None]):
    """Returns a given force, or raises a given error."""

    def __init__(self, output):
        self.output = output

    def command(self, estimate, target):
        if isinstance(self.output, Exception):
            raise self.output
        return Command(self.output)


def manager_with(output) -> ControllerManager:
    manager = manager_of(algorithm="coast")
    object.__setattr__(manager.configuration, "design", Scripted(output))
    return manager


any_floats = st.floats(allow_nan=True, allow_infinity=True)


@settings(deadline=None)
@given(
    output=hnp.arrays(float, 3, elements=any_floats),
    state=hnp.arrays(float, 6, elements=any_floats),
    goal=hnp.arrays(float, 6, elements=any_floats),
)
def test_no_law_and_no_estimate_exceeds_the_thrust_limit(output, state, goal, estimate, target):
    manager = manager_with(output)
    for tick in range(2):
        thrust, status = manager.on_tick(estimate(state, 10.0 * tick), target(goal, 10.0 * tick))
        assert np.isfinite(thrust.force).all()
        assert (np.abs(thrust.force) <= 0.01).all()
        assert np.isfinite(status.demand).all()


@pytest.mark.parametrize("error", [ZeroDivisionError("by zero"), np.linalg.LinAlgError("singular"), ValueError("no")])
def test_a_failing_law_gives_no_thrust_and_the_reason(error, estimate, target):
    thrust, status = manager_with(error).on_tick(estimate(AWAY), target())
    assert not thrust.force.any()
    assert str(error) in status.fallback


def test_an_estimate_that_is_not_finite_does_not_reach_the_law(estimate, target):
    manager = manager_of()
    thrust, status = manager.on_tick(estimate(np.nan * AWAY), target())
    assert not thrust.force.any()
    assert status.fallback == "estimate not finite: no thrust"
    thrust, status = manager.on_tick(estimate(AWAY, 10.0), target(time=10.0))
    assert thrust.force.any()
    assert not status.fallback


def test_a_fallback_is_an_event_when_it_begins_changes_and_ends(estimate, target):
    manager = manager_of()
    for tick, state in enumerate([AWAY, np.nan * AWAY, np.nan * AWAY, AWAY, AWAY]):
        manager.on_tick(estimate(state, 10.0 * tick), target(time=10.0 * tick))
    events = [(event.tick, event.detail) for event in manager.take_events() if event.kind == EventKind.FALLBACK]
    assert events == [(1, "estimate not finite: no thrust"), (3, "over")]


@pytest.mark.parametrize("share", [0.05, 0.5, 2.0])
def test_a_handover_step_is_bounded_and_the_force_converges(share, estimate, target):
    manager = manager_of(handover_step=share)
    swap = {1: "coast", 60: "lqr"}
    forces = []
    for tick in range(120):
        if tick in swap:
            manager.commit(manager.stage({"algorithm": swap[tick]}))
        # clipped, yet not so far off that the law would fly a trajectory, which a state at rest does not follow
        thrust, status = manager.on_tick(estimate(0.02 * AWAY, 10.0 * tick), target(time=10.0 * tick))
        forces.append(thrust.force)
    steps = np.abs(np.diff(forces, axis=0)).max(axis=0)
    assert (steps <= share * 0.01 * (1.0 + 1e-12)).all()
    assert not forces[59].any()
    np.testing.assert_array_equal(forces[-1], np.clip(status.demand, -0.01, 0.01))
    events = [event for event in manager.take_events() if event.kind == EventKind.HANDOVER]
    assert [event.tick for event in events] == [1, 60]
    assert (events[0].subject, events[0].detail[:26]) == ("coast", "from lqr: step in force [0")


def test_a_rejected_change_has_no_effect(estimate, target):
    manager, other = manager_of(), manager_of()
    with pytest.raises(ConfigurationError, match="state_weight has 2 values"):
        manager.stage({"lqr.state_weight": (1.0, 2.0)})
    for tick in range(3):
        ours = manager.on_tick(estimate(AWAY, 10.0 * tick), target(time=10.0 * tick))[0]
        np.testing.assert_array_equal(ours.force, other.on_tick(estimate(AWAY, 10.0 * tick), target())[0].force)
    assert not manager.take_events()


def test_a_thrust_limit_of_zero_is_rejected():
    with pytest.raises(ConfigurationError, match="thrust_limit"):
        manager_of(thrust_limit=(0.0, 0.0, 0.0))
