"""Targets carried forward by each model, and what a guide tells and rejects."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.guidance import Guidance, GuidanceParameters, check_places
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import advance_with_transition
from formation_gnc.parameters import load
from formation_gnc.records import EventKind, NavigationState
from formation_gnc.types import NANOSECONDS

Array = NDArray[np.float64]

EQUINOX = (9210 - 0.5) * 86400.0  # s since J2000.0: 20 March 2025, the Sun on the x axis


def common(eccentricity: float = 0.0, anomaly: float = 0.4, inclination: float = 0.9) -> CommonParameters:
    return CommonParameters(Orbit(7.0e6 / (1.0 - eccentricity), eccentricity, inclination, 0.0, 0.3, anomaly))


def path(
    model: str, name: str, about: CommonParameters, phase: float = 0.0, slot: int = 0, **values: float
) -> TargetPath:
    formation = FORMATIONS[name]
    return TARGET_MODELS[model](formation(formation.Parameters(**values), about.mean_motion, slot), phase, about)


closed = st.sampled_from(["projected_circular_orbit", "general_circular_orbit", "tetrahedral", "helix", "moving_plane"])
phases = st.floats(-10.0, 10.0)


@given(closed, phases)
def test_the_phase_shifts_a_formation_in_time(name: str, phase: float) -> None:
    about = common()
    times = np.linspace(0.0, 6000.0, 7)
    shifted = path("hill", name, about, phase).states(times)
    expected = path("hill", name, about).states(times + phase / about.mean_motion)
    assert shifted == pytest.approx(expected, abs=1e-9)


@given(closed, phases, st.floats(0.0, math.tau))
def test_about_a_circular_chief_yamanaka_and_ankersens_path_is_hills(name: str, phase: float, anomaly: float) -> None:
    about = common(0.0, anomaly)
    times = np.linspace(0.0, 6e4, 20)  # ten revolutions
    ours = path("yamanaka_ankersen", name, about, phase).states(times)
    assert ours == pytest.approx(path("hill", name, about, phase).states(times), abs=1e-6)


@given(closed, phases, st.floats(0.0, 0.7), st.floats(0.0, math.tau))
def test_about_an_eccentric_chief_the_path_closes(name: str, phase: float, e: float, anomaly: float) -> None:
    about = common(e, anomaly)
    period = math.tau / about.mean_motion
    carried = path("yamanaka_ankersen", name, about, phase)
    first = carried.states(np.linspace(0.0, period, 8))
    last = carried.states(np.linspace(10.0 * period, 11.0 * period, 8))
    assert last == pytest.approx(first, abs=1e-6 * np.abs(first).max())


@given(closed, phases, st.floats(0.0, 0.7), st.floats(0.0, math.tau))
def test_about_an_eccentric_chief_the_radial_motion_is_a_sine_of_the_anomaly(
    name: str, phase: float, e: float, anomaly: float
) -> None:
    about = common(e, anomaly)
    n = about.mean_motion
    carried = path("yamanaka_ankersen", name, about, phase)
    start = path("hill", name, about, phase).states(np.array([0.0]))[0]
    x = carried.states(np.linspace(0.0, math.tau / n, 50))[:, 0]
    assert np.abs(x).max() <= np.hypot(start[0], start[3] / n) * (1.0 + 1e-9) + 1e-9


def test_a_formation_that_is_to_drift_drifts_in_every_model() -> None:
    about = common()
    for model in TARGET_MODELS:
        carried = path(model, "relative_orbit", about, rho=0.0, a=10.0)
        first, last = carried.states(np.array([0.0, math.tau / about.mean_motion]))
        assert last[1] - first[1] == pytest.approx(-30.0 * math.pi, rel=0.05)  # the rates of J2 add a percent


def drift(model: str, about: CommonParameters) -> float:
    """Largest distance (m) from a target to a satellite that starts on it and flies ten orbits under J2."""
    carried = path(model, "projected_circular_orbit", about, slot=1)
    step = math.tau / about.mean_motion / 16.0
    targets = carried.states(step * np.arange(161))
    chief = state_from_elements(Elements(**vars(about.chief)))
    deputy, worst = inertial_from_relative(chief, targets[0]), 0.0
    for target in targets:
        worst = max(worst, float(np.linalg.norm((relative_from_inertial(chief, deputy) - target)[:3])))
        chief, deputy = (advance_with_transition(state, np.zeros(3), step, 20)[0] for state in (chief, deputy))
    return worst


def test_each_model_drifts_least_where_it_belongs() -> None:
    circular, eccentric = common(), common(0.1)
    # measured: 131 m and 327 m; the start leaves out the short-period terms of J2
    assert drift("j2_mean_motion", circular) < 0.5 * drift("hill", circular)
    assert drift("yamanaka_ankersen", eccentric) < 0.03 * drift("hill", eccentric)


@pytest.mark.parametrize(("size", "told"), [(1000.0, False), (50_000.0, True)])
def test_the_error_of_a_linear_model_grows_with_the_square_of_the_size(size: float, told: bool) -> None:
    about = common()
    error, extent = path("hill", "projected_circular_orbit", about, size=size).error()
    half, _ = path("hill", "projected_circular_orbit", about, size=size / 2.0).error()
    assert error == pytest.approx(4.0 * half, rel=0.05)
    assert (error > 0.05 * extent) == told


def guide(**values: Any) -> Guidance:
    given_values = {name.replace("__", "."): value for name, value in values.items()}
    return Guidance("/deputy1/guidance", load(GuidanceParameters, {"chief.semi_major_axis": 7.0e6} | given_values))


@pytest.fixture(scope="module")
def at() -> Callable[..., NavigationState]:
    """An estimate at a time in s, of a satellite 100 m behind."""

    def build(second: float) -> NavigationState:
        behind = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0])
        return NavigationState(round(second * NANOSECONDS), behind, np.zeros(6), 100.0)

    return build


def logged(guided: Guidance) -> list[tuple[int, str, str]]:
    return [(event.kind, event.subject, event.detail) for event in guided.take_events()]


def test_a_model_that_does_not_serve_is_told_once(at: Callable[..., NavigationState]) -> None:
    guided = guide(formation="projected_circular_orbit", projected_circular_orbit__size=50_000.0)
    guided.on_tick(at(0.0))
    guided.on_tick(at(1.0))
    ((kind, subject, detail),) = logged(guided)
    assert (kind, subject) == (EventKind.WARNING, "projected_circular_orbit")
    assert "in model hill: off by " in detail
    eccentric = guide(chief__semi_major_axis=7.5e6, chief__eccentricity=0.05)
    eccentric.on_tick(at(0.0))
    assert [kind for kind, *_ in logged(eccentric)] == [EventKind.WARNING]
    served = guide(chief__semi_major_axis=7.5e6, chief__eccentricity=0.05, model="yamanaka_ankersen")
    served.on_tick(at(0.0))
    assert logged(served) == []


def test_a_change_of_target_tells_the_shortest_time(at: Callable[..., NavigationState]) -> None:
    guided = guide(schedule=["{at: 10, leader_follower.separation: 300}"])
    guided.on_tick(at(9.0))
    assert logged(guided) == []
    guided.on_tick(at(10.0))
    changed, (kind, subject, detail) = logged(guided)
    assert changed[0] == EventKind.PARAMETERS
    assert (kind, subject) == (EventKind.RECONFIGURATION, "leader_follower")
    assert detail.startswith("from leader_follower to place 0: 200 m to go, for which the thrusters need")


def test_a_target_out_of_reach_in_the_time_given_is_reported_and_flown_to(
    at: Callable[..., NavigationState],
) -> None:
    guided = guide(reconfiguration_time=100.0, schedule=["{at: 10, leader_follower.separation: 300}"])
    assert guided.on_tick(at(10.0))[0].relative_state[1] == -300.0
    assert [kind for kind, *_ in logged(guided)] == [EventKind.PARAMETERS, EventKind.INFEASIBLE]


def test_no_change_is_taken_while_another_is_under_way(at: Callable[..., NavigationState]) -> None:
    guided = guide(reconfiguration_time=100.0, schedule=["{at: 50, leader_follower.separation: 150}"])
    guided.commit(guided.stage({"leader_follower.separation": 120.0}))
    guided.on_tick(at(10.0))
    logged(guided)
    with pytest.raises(ConfigurationError, match="under way until 110 s; the target stays"):
        guided.stage({"leader_follower.separation": 140.0})
    assert guided.on_tick(at(50.0))[0].relative_state[1] == -120.0
    assert [kind for kind, *_ in logged(guided)] == [EventKind.REJECTED]
    guided.on_tick(at(110.0))
    guided.commit(guided.stage({"leader_follower.separation": 140.0}))
    assert guided.on_tick(at(111.0))[0].relative_state[1] == -140.0


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"formation": "ring_of_fire"}, "formation: 'ring_of_fire' is not allowed"),
        (
            {"formation": "tetrahedral", "slot": 4},
            "slot: 4 is not allowed; it must be below 4, the places of tetrahedral",
        ),
        (
            {"formation": "helix", "helix__satellites": 2, "slot": 2},
            "slot: 2 is not allowed; it must be below 2",
        ),
        ({"formation": "helix", "helix__size": 0.0}, "helix.size: 0.0 is not allowed; it must be above 0"),
        ({"leader_follower__separation": 0.0}, "its size is zero"),
        ({"formation": "helix", "helix__size": 9e8}, "no orbit about the Earth"),
    ],
)
def test_what_is_no_formation_is_rejected_with_a_reason(values: dict[str, Any], reason: str) -> None:
    with pytest.raises(ConfigurationError, match=reason):
        guide(**values)


def test_a_rejected_change_leaves_the_target(at: Callable[..., NavigationState]) -> None:
    guided = guide()
    with pytest.raises(ConfigurationError):
        guided.stage({"formation": "tetrahedral", "slot": 9})
    assert guided.on_tick(at(1.0))[0].relative_state[1] == -100.0


def test_two_satellites_on_one_place_are_rejected_now_and_later() -> None:
    def parameters(slot: int, **values: Any) -> Any:
        return guide(formation="tetrahedral", slot=slot, **values).parameters

    check_places({"a": parameters(0), "b": parameters(1), "c": parameters(2), "d": parameters(3)})
    with pytest.raises(ConfigurationError, match=r"a and c are on one place from 0 s: tetrahedral, slot 2"):
        check_places({"a": parameters(2), "b": parameters(1), "c": parameters(2)})
    later = parameters(0, schedule=["{at: 60, slot: 1}"])
    with pytest.raises(ConfigurationError, match=r"a and b are on one place from 60 s"):
        check_places({"a": later, "b": parameters(1)})


CHIEF = state_from_elements(Elements(7.0e6, 0.0, 0.4, 0.0, 0.0, 0.0))


def eclipse_of(guided: Guidance, seconds: float, chief: Array) -> Array:
    time = round(seconds * NANOSECONDS)
    return guided.on_tick(NavigationState(time, np.ones(6), chief, 1.0))[0].eclipses


def test_the_coming_eclipses_come_with_the_target_until_they_are_over() -> None:
    guided = guide(epoch=EQUINOX)
    revolution = math.tau / guided.parameters.mean_motion

    def eclipse_at(share: float) -> Array:
        seconds = share * revolution
        state = advance_with_transition(CHIEF, np.zeros(3), seconds, 200)[0] if seconds else CHIEF
        return eclipse_of(guided, seconds, state)

    first = eclipse_at(0.0)
    assert len(first) == 2  # two revolutions ahead
    assert eclipse_at(0.5).tolist() == first.tolist()  # under way
    assert eclipse_at(0.9).tolist() == first[1:].tolist()
    again = eclipse_at(1.01)  # looked for anew, from where the chief has come
    assert len(again) == 2
    assert again[0] == pytest.approx(first[1], abs=0.1 * NANOSECONDS)


def test_a_chief_that_flies_nowhere_has_no_eclipse(at: Callable[..., NavigationState]) -> None:
    assert not len(guide().on_tick(at(0.0))[0].eclipses)


@pytest.mark.parametrize("bad", [np.full(6, np.nan), np.zeros(6)])
def test_eclipses_are_looked_for_again_soon_after_a_bad_chief_and_kept_until_then(bad: Array) -> None:
    fresh, guided = guide(epoch=EQUINOX), guide(epoch=EQUINOX)
    assert not len(eclipse_of(fresh, 0.0, bad))
    step = math.tau / fresh.parameters.mean_motion / 180
    assert len(eclipse_of(fresh, step + 1e-3, CHIEF)) == 2
    first = eclipse_of(guided, 0.0, CHIEF)
    assert eclipse_of(guided, 181 * step, bad).tolist() == first[1:].tolist(), "looked two revolutions ahead"
