"""Guidance of one deputy: target, preview, changes in flight, and the events that report them."""

from typing import Any

import numpy as np
import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.records import EventKind
from formation_gnc.types import NANOSECONDS

from .conftest import BuildGuidance, EstimateAt


def logged(guidance: Guidance) -> list[tuple[int, str, str]]:
    return [(event.kind, event.subject, event.detail) for event in guidance.take_events()]


def test_target_is_the_formations_state_at_the_stamp(build_guidance: BuildGuidance, estimate_at: EstimateAt) -> None:
    guidance = build_guidance(formation="relative_orbit", relative_orbit__rho=300.0)
    target, _ = guidance.on_tick(estimate_at(77.0))
    formation = RelativeOrbit(RelativeOrbitParameters(rho=300.0), guidance.parameters.mean_motion)
    assert (target.time, target.formation) == (77 * NANOSECONDS, "relative_orbit")
    # in curvilinear coordinates: 600 m along the orbit, the circle is by 26 mm below the tangent
    assert target.relative_state[:3] == pytest.approx(formation.states(np.array([77.0]))[0, :3], abs=0.026)
    assert target.preview.shape == (0, 6)


def test_preview_is_the_target_at_later_times(build_guidance: BuildGuidance, estimate_at: EstimateAt) -> None:
    ahead = build_guidance(formation="relative_orbit", preview_steps=4, preview_step=30.0)
    preview = ahead.on_tick(estimate_at(10.0))[0].preview
    later = [ahead.on_tick(estimate_at(10.0 + 30.0 * step))[0].relative_state.tolist() for step in (1, 2, 3, 4)]
    assert preview.tolist() == later


def test_formation_changes_in_flight_at_a_tick(build_guidance: BuildGuidance, estimate_at: EstimateAt) -> None:
    swapped = build_guidance(schedule=["{at: 20, formation: relative_orbit, relative_orbit.rho: 50}"])
    assert swapped.on_tick(estimate_at(19.0))[0].relative_state == pytest.approx(
        [0.0, -100.0, 0.0, 0.0, 0.0, 0.0], abs=1e-3
    )
    target, _ = swapped.on_tick(estimate_at(20.0))
    assert target.formation == "relative_orbit"
    assert np.abs(target.relative_state[0]) <= 50.0
    swapped.commit(swapped.stage({"formation": "leader_follower", "leader_follower.separation": 40.0}))
    assert swapped.on_tick(estimate_at(21.0))[0].relative_state == pytest.approx(
        [0.0, -40.0, 0.0, 0.0, 0.0, 0.0], abs=1e-3
    )


def test_model_that_does_not_fit_the_formation_is_reported_once(
    build_guidance: BuildGuidance, estimate_at: EstimateAt
) -> None:
    guidance = build_guidance(formation="projected_circular_orbit", projected_circular_orbit__size=50_000.0)
    guidance.on_tick(estimate_at(0.0))
    guidance.on_tick(estimate_at(1.0))
    ((kind, subject, detail),) = logged(guidance)
    assert (kind, subject) == (EventKind.WARNING, "projected_circular_orbit")
    assert "in model hill: off by " in detail
    eccentric = build_guidance(chief__semi_major_axis=7.5e6, chief__eccentricity=0.05)
    eccentric.on_tick(estimate_at(0.0))
    assert [kind for kind, *_ in logged(eccentric)] == [EventKind.WARNING]
    fitting = build_guidance(chief__semi_major_axis=7.5e6, chief__eccentricity=0.05, model="yamanaka_ankersen")
    fitting.on_tick(estimate_at(0.0))
    assert logged(fitting) == []


def test_change_of_target_reports_the_shortest_time(build_guidance: BuildGuidance, estimate_at: EstimateAt) -> None:
    guidance = build_guidance(schedule=["{at: 10, leader_follower.separation: 300}"])
    guidance.on_tick(estimate_at(9.0))
    assert logged(guidance) == []
    guidance.on_tick(estimate_at(10.0))
    changed, (kind, subject, detail) = logged(guidance)
    assert changed[0] == EventKind.PARAMETERS
    assert (kind, subject) == (EventKind.RECONFIGURATION, "leader_follower")
    assert detail.startswith("from leader_follower to slot 0: 200 m to go, shortest time")


def test_target_beyond_reach_in_the_time_allowed_is_reported_and_kept(
    build_guidance: BuildGuidance,
    estimate_at: EstimateAt,
) -> None:
    guidance = build_guidance(reconfiguration_time=100.0, schedule=["{at: 10, leader_follower.separation: 300}"])
    assert guidance.on_tick(estimate_at(10.0))[0].relative_state[1] == pytest.approx(-300.0, abs=1e-6)
    assert [kind for kind, *_ in logged(guidance)] == [EventKind.PARAMETERS, EventKind.INFEASIBLE]


def test_no_change_of_target_during_a_reconfiguration(build_guidance: BuildGuidance, estimate_at: EstimateAt) -> None:
    guidance = build_guidance(reconfiguration_time=100.0, schedule=["{at: 50, leader_follower.separation: 150}"])
    guidance.commit(guidance.stage({"leader_follower.separation": 120.0}))
    guidance.on_tick(estimate_at(10.0))
    logged(guidance)
    with pytest.raises(ConfigurationError, match="under way until 110 s; the target stays"):
        guidance.stage({"leader_follower.separation": 140.0})
    assert guidance.on_tick(estimate_at(50.0))[0].relative_state[1] == pytest.approx(-120.0, abs=1e-6)
    assert [kind for kind, *_ in logged(guidance)] == [EventKind.REJECTED]
    guidance.on_tick(estimate_at(110.0))
    guidance.commit(guidance.stage({"leader_follower.separation": 140.0}))
    assert guidance.on_tick(estimate_at(111.0))[0].relative_state[1] == pytest.approx(-140.0, abs=1e-6)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"formation": "ring_of_fire"}, "formation: 'ring_of_fire' is not allowed"),
        (
            {"formation": "tetrahedral", "slot": 4},
            "slot: 4 is not allowed; it must be below 4, the slots of tetrahedral",
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
def test_invalid_formation_is_rejected_with_a_reason(
    build_guidance: BuildGuidance, values: dict[str, Any], reason: str
) -> None:
    with pytest.raises(ConfigurationError, match=reason):
        build_guidance(**values)


def test_rejected_change_keeps_the_target(build_guidance: BuildGuidance, estimate_at: EstimateAt) -> None:
    guidance = build_guidance()
    with pytest.raises(ConfigurationError):
        guidance.stage({"formation": "tetrahedral", "slot": 9})
    assert guidance.on_tick(estimate_at(1.0))[0].relative_state[1] == pytest.approx(-100.0, abs=1e-6)


@pytest.mark.parametrize(
    "constants", [{"rho": 1e308}, {"a": -1e9}, {"b": 1e300}, {"m": 1e200, "rho": 1e200}, {"n": 1e7}]
)
def test_formation_whose_targets_would_overflow_is_rejected(
    build_guidance: BuildGuidance, constants: dict[str, float]
) -> None:
    values = {f"relative_orbit__{name}": value for name, value in constants.items()}
    with pytest.raises(ConfigurationError, match="formation relative_orbit: its parameters put a target"):
        build_guidance(formation="relative_orbit", **values)
    build_guidance(formation="leader_follower", **values)  # not in force, so not checked
