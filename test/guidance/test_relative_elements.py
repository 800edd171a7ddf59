"""The formation by relative elements, and target paths that J2 alone flies."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.errors import OrbitError
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.relative_elements import RelativeElements, RelativeElementsParameters
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.records import EventKind, NavigationState
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.relative_elements import mean_relative_elements
from formation_gnc.types import Vector

from .conftest import BuildGuidance

TERRASAR = Orbit(
    6886536.686, 0.0001264, math.radians(97.4453), math.radians(351.0108), math.radians(101.2452), math.radians(11.652)
)
CHIEF = state_from_elements(Elements(**vars(TERRASAR)))

metres = st.floats(-500.0, 500.0)
given_elements = st.builds(RelativeElementsParameters, *[metres] * 6)


def path(name: str, parameters: Any, model: str, orbit: Orbit = TERRASAR, phase: float = 0.0) -> TargetPath:
    common = CommonParameters(orbit)
    return TARGET_MODELS[model](FORMATIONS[name](parameters, common.mean_motion), phase, common)


def coasted(state: Vector, duration: float) -> Vector:
    return propagate_with_transition(state, np.zeros(3), duration, math.ceil(duration / 20.0))[0]


def drift(target: TargetPath, chief: Vector, revolutions: float, period: float) -> float:
    """Largest distance (m) of free motion under J2 from a path, anchored to the true chief, in some revolutions."""
    deputy = inertial_from_relative(chief, target.states(np.zeros(1))[0])
    off, step = [], 0.1 * period
    for k in range(1, round(10.0 * revolutions) + 1):
        chief, deputy = coasted(chief, step), coasted(deputy, step)
        aim = target.anchored(chief, k * step).states(np.array([k * step]))[0]
        off.append(np.linalg.norm(aim[:3] - relative_from_inertial(chief, deputy)[:3]))
    return float(max(off))


@given(given_elements, st.floats(0.0, 6.0), st.floats(0.0, 1e4))
def test_states_are_free_motion_under_hills_equations(parameters: Any, anomaly: float, time: float) -> None:
    n = CommonParameters(TERRASAR).mean_motion
    formation = RelativeElements(parameters, n).about(CHIEF)
    before, after = formation.states(np.array([time, time + 3000.0]))
    np.testing.assert_allclose(HillModel(n).transition(0.0, 3000.0) @ before, after, rtol=0.0, atol=1e-7)


@given(given_elements, st.floats(-6.0, 6.0))
def test_a_phase_turns_the_vectors_back(parameters: Any, phase: float) -> None:
    n = CommonParameters(TERRASAR).mean_motion
    formation = RelativeElements(parameters, n)
    turned = RelativeElements(RelativeElementsParameters(*formation.elements(phase)), n)
    shifted = formation.states(np.array([phase / n]))
    np.testing.assert_allclose(turned.states(np.zeros(1)), shifted, rtol=0.0, atol=1e-8)


@settings(max_examples=10)
@given(given_elements)
def test_a_target_has_the_elements_that_are_given(parameters: Any) -> None:
    target = path("relative_elements", parameters, "relative_elements")
    found = mean_relative_elements(CHIEF, target.states(np.zeros(1))[0])
    np.testing.assert_allclose(found, list(vars(parameters).values()), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("relative_elements", {"dey": 300.0, "diy": 400.0}),
        ("relative_elements", {"da": 5.0, "dix": 200.0, "dlambda": 2e5}),
        ("leader_follower", {"separation": 2.2e5}),
        ("projected_circular_orbit", {"size": 500.0}),
    ],
)
def test_j2_alone_flies_a_path_by_relative_elements(name: str, values: dict[str, float]) -> None:
    """What is left is of the order of J2 squared: a few parts in a million of the size and revolution."""
    target = path(name, FORMATIONS[name].Parameters(**values), "relative_elements")
    size = float(np.linalg.norm(target.states(np.zeros(1))[0, :3]))
    period = math.tau / CommonParameters(TERRASAR).mean_motion
    assert drift(target, CHIEF, 5.0, period) < 2e-5 * 5.0 * size


@pytest.mark.parametrize("eccentricity", [0.05, 0.4, 0.7])
def test_j2_alone_flies_a_path_about_an_eccentric_chief(eccentricity: float) -> None:
    orbit = Orbit(7e6 / (1.0 - eccentricity), eccentricity, 1.0, 0.3, 0.4, 0.5)
    target = path("helix", FORMATIONS["helix"].Parameters(size=500.0), "relative_elements", orbit)
    chief, period = state_from_elements(Elements(**vars(orbit))), math.tau / CommonParameters(orbit).mean_motion
    assert drift(target, chief, 3.0, period) < 1e-4 * 3.0 * 500.0 / (1.0 - eccentricity)
    linear = path("helix", FORMATIONS["helix"].Parameters(size=500.0), "yamanaka_ankersen", orbit)
    assert drift(linear, chief, 3.0, period) > 3.0


def test_a_drifting_formation_keeps_its_drift() -> None:
    parameters = FORMATIONS["relative_orbit"].Parameters(rho=200.0, a=10.0)
    target = path("relative_orbit", parameters, "relative_elements")
    period = math.tau / CommonParameters(TERRASAR).mean_motion
    at_nodes = target.states(np.array([0.0, 10.0 * period]))
    # 3 pi times the radial offset a revolution; a period of the osculating orbit leaves a part in a thousand.
    moved = at_nodes[1, 1] - at_nodes[0, 1]
    assert moved == pytest.approx(-30.0 * math.pi * 10.0, rel=0.02)


def test_a_chief_without_a_node_is_rejected_for_the_model() -> None:
    with pytest.raises(OrbitError, match=r"inclination is .*: relative elements need a node"):
        path("leader_follower", FORMATIONS["leader_follower"].Parameters(), "relative_elements", Orbit(4.2e7))


@pytest.mark.parametrize("chief", [np.zeros(6), np.full(6, np.nan), np.array([1e7, 0, 0, 0, 9e3, 0])])
def test_a_chief_on_no_orbit_leaves_the_path_as_it_is(chief: Vector) -> None:
    target = path("relative_elements", RelativeElementsParameters(), "relative_elements")
    times = np.array([60.0, 120.0])
    np.testing.assert_array_equal(target.anchored(chief, 60.0).states(times), target.states(times))


def test_a_target_that_is_not_passively_safe_is_reported(build_guidance: BuildGuidance) -> None:
    chief = {f"chief__{name}": value for name, value in vars(TERRASAR).items()}
    safe = {"formation": "relative_elements", "model": "relative_elements", "safe_distance": 100.0}
    away = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0])
    guidance = build_guidance(**(chief | safe))
    guidance.on_tick(NavigationState(0, away, CHIEF, 100.0))
    assert not [each for each in guidance.take_events() if each.kind == EventKind.WARNING]
    guidance.commit(guidance.stage({"relative_elements.dey": 0.0, "relative_elements.dex": 300.0}))
    guidance.on_tick(NavigationState(60_000_000_000, away, CHIEF, 100.0))
    (warning,) = [each for each in guidance.take_events() if each.kind == EventKind.WARNING]
    assert warning.subject == "relative_elements"
    assert warning.detail.startswith("not passively safe: ")
    assert "below safe_distance, 100 m" in warning.detail
    without = build_guidance(formation="leader_follower", safe_distance=1.0)
    without.on_tick(NavigationState(0, away, np.zeros(6), 100.0))
    assert [each.kind for each in without.take_events()] == [EventKind.WARNING]
