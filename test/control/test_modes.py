"""The controller in every mode: who flies, with which axes and law."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.mode_records import Mode, ModeState, Restriction
from formation_gnc.parameters import load
from formation_gnc.records import EventKind, Status, Thrust

AWAY = np.array([50.0, -20.0, 10.0, 0.0, 0.0, 0.0])
PUSH = np.array([0.001, 0.0, -0.002])

Fly = Callable[..., tuple[Thrust, Status]]


def build() -> ControllerManager:
    values = {"chief.semi_major_axis": 6978100.0, "tick": 10.0, "lqr.thrust": (0.002, 0.002, 0.002)}
    return ControllerManager("controller", load(ControllerParameters, values))


@pytest.fixture
def manager() -> ControllerManager:
    return build()


@pytest.fixture
def free() -> dict[str, Any]:
    """Thrust and status of the same law without a supervisor, at the last tick."""
    return {}


@pytest.fixture
def fly(
    manager: ControllerManager, free: dict[str, Any], estimate: Callable[..., Any], target: Callable[..., Any]
) -> Fly:
    """Fly the next tick with the mode of the one before, or without."""
    ticks, other = iter(range(1000)), build()

    def fly(mode: str = "", *restrictions: Restriction, force: Any = PUSH) -> tuple[Thrust, Status]:
        time = 10.0 * next(ticks)
        state = ModeState(0, mode, mode, 0, force=np.array(force), restrictions=list(restrictions)) if mode else None
        free["thrust"], free["status"] = other.on_tick(estimate(AWAY, time), target(time=time))
        return manager.on_tick(estimate(AWAY, time), target(time=time), state)

    return fly


@pytest.mark.parametrize("mode", [Mode.ACQUIRE, Mode.KEEP, Mode.RECONFIGURE])
def test_the_law_flies_as_without_a_supervisor(fly: Fly, free: dict[str, Any], mode: Mode) -> None:
    thrust, status = fly(mode)
    np.testing.assert_array_equal(thrust.force, free["thrust"].force)
    assert (status.algorithm, status.mode) == ("lqr", mode)


def test_standby_is_without_thrust_and_the_law_begins_anew_after_it(fly: Fly) -> None:
    first, _ = fly("keep")
    thrust, status = fly("standby")
    assert not thrust.force.any()
    assert (status.solver, status.fallback) == ("mode standby", "")
    np.testing.assert_array_equal(fly("acquire")[0].force, first.force)


@pytest.mark.parametrize("mode", ["avoid", "safe"])
def test_modes_that_evade_fly_their_plan_within_the_limits(fly: Fly, mode: str) -> None:
    np.testing.assert_array_equal(fly(mode)[0].force, PUSH)
    assert fly(mode, force=[1.0, 0.0, 0.0])[0].force.tolist() == [0.01, 0.0, 0.0]
    assert not fly(mode, force=[np.nan, 0.0, 0.0])[0].force.any()


def test_without_a_supervisor_its_mode_stands_and_its_plan_does_not(fly: Fly, manager: ControllerManager) -> None:
    fly("safe")
    thrust, status = fly()
    assert not thrust.force.any()
    assert status.mode == "safe"
    fly()
    (event,) = [each for each in manager.take_events() if each.kind == EventKind.WARNING]
    assert event.detail == "the supervisor is silent: safe stands"


def test_an_isolated_axis_gets_no_thrust(fly: Fly, free: dict[str, Any]) -> None:
    thrust, _ = fly("keep", Restriction("axis", "y", "thrust_response y"))
    x, _, z = free["thrust"].force
    assert thrust.force.tolist() == [x, 0.0, z]


def test_the_first_law_of_the_order_that_is_another_takes_over(fly: Fly, manager: ControllerManager) -> None:
    order = [Restriction("law", name, "solver_fallback") for name in ("lqr", "coast", "mpc")]
    fly("keep")
    thrust, status = fly("keep", *order)
    assert status.algorithm == "coast"
    assert manager.parameters.algorithm == "lqr"
    for _ in range(20):
        thrust, _ = fly("keep", *order)
    assert not thrust.force.any()
    assert fly("keep")[1].algorithm == "lqr"
    handovers = [each.subject for each in manager.take_events() if each.kind == EventKind.HANDOVER]
    assert handovers == ["coast", "lqr"]


def test_a_law_that_is_commanded_goes_before_the_order(fly: Fly, manager: ControllerManager) -> None:
    order = Restriction("law", "coast", "solver_fallback")
    assert fly("keep", order)[1].algorithm == "coast"
    manager.commit(manager.stage({"algorithm": "sdre"}))
    assert fly("keep", order)[1].algorithm == "sdre"
