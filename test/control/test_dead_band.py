"""The dead band: no law thrusts while its error is tolerated, and each acts again when it is not."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.dead_band import is_tolerated
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import load
from formation_gnc.records import EventKind, NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.types import NANOSECONDS, Vector

AXIS = 7.0e6
CHIEF = np.array([AXIS, 0.0, 0.0, 0.0, 7546.0, 0.0])
BAND = [5.0, 5.0, 5.0]
RATE = 1e-3


def manager_of(algorithm: str, **values: object) -> ControllerManager:
    given = {"chief.semi_major_axis": AXIS, "algorithm": algorithm, "dead_band": BAND, **values}
    return ControllerManager("/deputy1/controller", load(ControllerParameters, given))


def force_at(manager: ControllerManager, second: int, along: float, drift: float = 0.0) -> Vector:
    """Force for an error along the track, m, and its rate, m/s, at a second of the flight."""
    time = second * NANOSECONDS
    state = np.array([0.0, along - 100.0, 0.0, 0.0, drift, 0.0])
    aim = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0])
    target = Target(
        time, "leader_follower", aim, 0, np.empty((0, 6)), np.empty((0, 2), dtype=np.int64), np.empty((0, 6))
    )
    thrust, status = manager.on_tick(NavigationState(time, state, CHIEF, 100.0), target)
    assert (status.solver == "dead band") == (not thrust.force.any() and not status.fallback and abs(along) <= 5.0)
    return thrust.force


@pytest.mark.parametrize("algorithm", sorted(ALGORITHMS.keys() - {"coast"}))
def test_every_law_is_silent_within_the_band_and_acts_beyond_it(algorithm: str) -> None:
    manager = manager_of(algorithm)
    assert not force_at(manager, 0, 4.0).any()
    acting = force_at(manager, 1, 6.0)
    assert acting.any()
    assert force_at(manager, 2, 4.0, 0.01).any(), "it would be out again within the revolution"
    assert not force_at(manager, 3, 4.0).any()
    assert not force_at(manager, 4, 4.0, 0.01).any(), "silent until beyond"
    again = force_at(manager, 5, 6.0)
    if algorithm != "adaptive_lqr":  # which has learned
        assert again == pytest.approx(acting, rel=0.02, abs=1e-5), "as if it began there"


@pytest.mark.parametrize("algorithm", ["lqr", "mpc", "hinf"])
def test_without_a_band_nothing_is_tolerated(algorithm: str) -> None:
    manager = manager_of(algorithm, dead_band=[0.0, 0.0, 0.0])
    assert force_at(manager, 0, 0.1).any()
    assert not is_tolerated([0.0] * 6, [5.0, 5.0, 0.0], RATE, is_silent=True), "two axes alone are none"


@given(
    st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3),
    st.lists(st.floats(-0.01, 0.01), min_size=3, max_size=3),
)
def test_the_law_ends_when_free_motion_stays_in_the_band(position: list[float], velocity: list[float]) -> None:
    """Of a revolution; the bound adds drift and oscillation, whose extremes need not meet."""
    error, times = [*position, *velocity], np.linspace(0.0, 2.0 * np.pi / RATE, 200)
    extent = np.abs(HillModel(RATE).transition(0.0, times) @ np.array(error))[:, :3].max(axis=0)
    assert not is_tolerated(error, (0.99 * extent).tolist(), RATE, is_silent=False)
    assert is_tolerated(error, (3.0 * extent + 1e-9).tolist(), RATE, is_silent=False)
    assert is_tolerated(error, [abs(each) + 1e-9 for each in position], RATE, is_silent=True)


def test_a_band_can_change_in_flight_and_is_checked() -> None:
    manager = manager_of("lqr")
    assert not force_at(manager, 0, 4.0).any()
    manager.commit(manager.stage({"dead_band": [1.0, 1.0, 1.0]}))
    assert force_at(manager, 1, 4.0).any()
    assert EventKind.PARAMETERS in [event.kind for event in manager.take_events()]
    with pytest.raises(ConfigurationError, match=r"dead_band: -1\.0 is not allowed; it must be 3 values, at least 0"):
        manager.stage({"dead_band": [1.0, -1.0, 1.0]})


def test_a_law_changed_in_the_band_stays_silent() -> None:
    manager = manager_of("lqr")
    force_at(manager, 0, 4.0)
    manager.commit(manager.stage({"algorithm": "hinf"}))
    assert not force_at(manager, 1, 4.0).any()
    assert force_at(manager, 2, 6.0).any()


@pytest.mark.thorough
def test_a_band_spares_propellant_and_holds_the_formation() -> None:
    """Three orbits of the default scenario after its acquisition, with a tolerance of a fifth of the separation."""
    spent = {}
    for band in (0.0, 20.0):
        plant = {"duration": 17400.0, "deputy1.relative_state": [0.0, -100.0, 0.0, 0.0, 0.0, 0.0]}
        overrides: dict[str, dict[str, Any]] = {"/**": {"tick": 10.0}, "/plant": plant}
        overrides["/**/controller"] = {"dead_band": [band] * 3}
        run, records = Run(load_scenario("leader_follower", overrides)), dict[str, Any]()
        total, worst = 0.0, 0.0
        while not run.plant.finished:
            run.tick(records.__setitem__)
            error = records["/truth"].deputies[0].relative_state - records["/deputy1/target"].relative_state
            total += float(np.abs(records["/deputy1/thrust"].force).sum()) / 10.0
            worst = max(worst, float(np.abs(error[:3]).max()))
        spent[band] = total
        assert worst < 25.0  # the band, and what is left of the drift when it is turned round
    assert spent[20.0] < 0.5 * spent[0.0]
