"""Guidance in a fleet: neighbours in the target, predicted separations, assigned slots."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.parameters import load
from formation_gnc.records import EventKind, NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS

Array = NDArray[np.float64]

FLEET = ("deputy1", "deputy2", "deputy3", "deputy4")
RING = {"formation": "projected_circular_orbit", "projected_circular_orbit.satellites": 4}


def parameters(**values: Any) -> Any:
    given = {name.replace("__", "."): value for name, value in values.items()}
    return load(GuidanceParameters, {"chief.semi_major_axis": 7.0e6, "fleet": FLEET} | RING | given)


def estimate(state: Array, seconds: float = 0.0, mass: float = 100.0) -> NavigationState:
    return NavigationState(round(seconds * NANOSECONDS), state, np.zeros(6), mass)


def fly(
    fleet: Mapping[str, Guidance],
    states: Array,
    seconds: float = 0.0,
    masses: tuple[float, ...] = (100.0,) * 4,
) -> list[Target]:
    """Targets of one tick of every guidance."""
    estimates = {name: estimate(state, seconds, mass) for name, state, mass in zip(fleet, states, masses, strict=True)}
    targets = []
    for name, guidance in fleet.items():
        target, _ = guidance.on_tick(estimates[name], None, *(estimates[other] for other in guidance.neighbours))
        targets.append(target)
    return targets


def fleet_of_four(**values: Any) -> dict[str, Guidance]:
    return {name: Guidance(f"/{name}/guidance", parameters(**values)) for name in FLEET}


def on_the_ring(phase: float) -> Array:
    """States of the four satellites in their slots of a ring."""
    states = [
        Guidance("/deputy1/guidance", parameters(slot=slot, phase=phase)).configuration.design.states(np.zeros(1))[0]
        for slot in range(4)
    ]
    return np.array(states)


def propagated(states: Array, seconds: float) -> Array:
    """States after free motion under Hill's equations."""
    moved: Array = states @ HillModel(parameters().mean_motion).transition(0.0, seconds).T
    return moved


def test_target_has_the_neighbours_in_the_order_of_the_fleet() -> None:
    states = on_the_ring(0.0)
    guidance = Guidance("/deputy2/guidance", parameters(slot=1))
    assert guidance.neighbours == ("deputy1", "deputy3", "deputy4")
    target, _ = guidance.on_tick(estimate(states[1]), None, estimate(states[0]), None, estimate(states[3]))
    assert target.neighbours.tolist() == [states[0].tolist(), states[3].tolist()]
    target, _ = guidance.on_tick(
        estimate(states[1], 1.0), None, estimate(states[0], 1.0), estimate(np.full(6, np.nan), 1.0), None
    )
    assert target.neighbours.tolist() == [states[0].tolist()]


def test_deputy_on_its_own_has_no_neighbour_and_no_separation() -> None:
    target, separation = Guidance("/deputy1/guidance", parameters(fleet=())).on_tick(estimate(np.ones(6)))
    assert target.neighbours.shape == (0, 6)
    assert separation is None


def test_predicted_separation_on_a_ring_is_the_side_of_its_square() -> None:
    states = on_the_ring(0.3)
    guidance = Guidance("/deputy1/guidance", parameters(phase=0.3, preview_steps=50, preview_step=60.0))
    _, separation = guidance.on_tick(estimate(states[0]), None, *map(estimate, states[1:]))
    assert separation is not None
    # positions at right angles on y^2 + z^2 = 1 km, radially up to half as much more: |d|^2 = 2 + (dx)^2 with
    # dx of amplitude sqrt(2)/2, zero four times in two revolutions
    assert separation.passive == pytest.approx(1000.0 * math.sqrt(2.0), rel=2e-3)
    assert separation.planned == pytest.approx(1000.0 * math.sqrt(2.0), rel=2e-3)
    assert separation.passive_neighbour in ("deputy2", "deputy4")


def test_collision_course_is_found_between_points_and_reported_once() -> None:
    guidance = Guidance("/deputy1/guidance", parameters(fleet=("deputy1", "deputy2"), separation_warning=20.0))
    n = guidance.parameters.mean_motion
    behind, ahead = np.zeros(6), np.zeros(6)
    behind[1], ahead[1] = -1000.0, 1000.0
    drifting = ahead.copy()
    drifting[0] = 2000.0 / (3.0 * math.pi)
    # x = c, y' = -3/2 n c is free motion that falls back 3 pi c in a revolution, the distance to the neighbour
    drifting[4] = -1.5 * n * drifting[0]
    _, separation = guidance.on_tick(estimate(behind), None, estimate(drifting))
    assert separation is not None
    assert separation.passive == pytest.approx(drifting[0], rel=1e-6)  # passes at that height
    assert separation.passive_time / NANOSECONDS == pytest.approx(
        2000.0 / (1.5 * n * drifting[0]),
        rel=1.5e-4,  # 1000 m ahead, the circle is by 1.4e-4 of that below the tangent
    )
    assert not [event for event in guidance.take_events() if event.kind == EventKind.SEPARATION]
    drifting[0] *= 0.04
    drifting[4] *= 0.04
    drifting[1] = -900.0
    assert guidance.on_tick(estimate(behind, 30.0), None, estimate(drifting, 30.0))[1] is None  # not due yet
    warnings = []
    for seconds in (60.0, 120.0):
        _, separation = guidance.on_tick(estimate(behind, seconds), None, estimate(drifting, seconds))
        assert separation is not None
        assert separation.passive < 20.0
        warnings += [event.detail for event in guidance.take_events() if event.kind == EventKind.SEPARATION]
    assert len(warnings) == 1
    guidance.on_tick(estimate(behind, 180.0), None, estimate(ahead, 180.0))
    assert [event.detail for event in guidance.take_events() if event.kind == EventKind.SEPARATION] == ["over"]


@pytest.mark.parametrize("model", ["hill", "j2_mean_motion", "yamanaka_ankersen"])
@pytest.mark.thorough
def test_fleet_in_formation_is_assigned_the_slots_it_is_in(model: str) -> None:
    order = [2, 0, 3, 1]
    states = on_the_ring(1.234)[order]
    fleet = fleet_of_four(assignment="delta_v", model=model)
    targets = fly(fleet, states)
    phases = {guidance.parameters.phase for guidance in fleet.values()}
    assert len(phases) == 1
    assert sorted(guidance.parameters.slot for guidance in fleet.values()) == [0, 1, 2, 3]
    # on the ring already; J2 rates start a little off it
    off = [np.linalg.norm((target.relative_state - state)[:3]) for target, state in zip(targets, states, strict=True)]
    assert max(off) < (1e-2 if model == "hill" else 5.0)
    assert [event.kind for event in fleet["deputy1"].take_events()] == [EventKind.ASSIGNMENT]


@pytest.mark.thorough
def test_slots_are_assigned_anew_at_a_scheduled_change_of_formation() -> None:
    change = "{at: 100.0, formation: three_in_plane_one_out}"
    fleet = fleet_of_four(assignment="delta_v", formation="tetrahedral", schedule=(change,))
    start = on_the_ring(0.0)
    before = fly(fleet, start)
    states = np.array([target.relative_state for target in before])
    after = fly(fleet, states, 100.0)
    assert {target.formation for target in after} == {"three_in_plane_one_out"}
    assert sorted(guidance.parameters.slot for guidance in fleet.values()) == [0, 1, 2, 3]
    kinds = [event.kind for event in fleet["deputy3"].take_events()]
    expected = [EventKind.ASSIGNMENT, EventKind.PARAMETERS, EventKind.ASSIGNMENT, EventKind.RECONFIGURATION]
    assert kinds == expected


def test_assignment_by_fuel_gives_the_emptier_tank_the_shorter_way() -> None:
    # slots 1 and 2 km behind: both satellites are nearer to the second, deputy2 by more
    values: dict[str, Any] = {
        "fleet": ("deputy1", "deputy2"),
        "formation": "leader_follower",
        "leader_follower__separation": 1000.0,
        "dry_masses": (90.0, 90.0),
    }
    states = np.zeros((2, 6))
    states[:, 1] = -1600.0, -1700.0

    def slots(assignment: str, masses: tuple[float, float]) -> list[int]:
        fleet = {
            name: Guidance(f"/{name}/guidance", parameters(**values, assignment=assignment))
            for name in ("deputy1", "deputy2")
        }
        fly(fleet, states, masses=masses)
        return [guidance.parameters.slot for guidance in fleet.values()]

    assert slots("delta_v", (91.0, 99.0)) == [0, 1]  # 600 m and 300 m
    assert slots("fuel", (99.0, 99.0)) == [0, 1]
    assert slots("fuel", (91.0, 99.0)) == [1, 0]  # 400 m and 700 m
    assert slots("fuel", (90.0, 99.0)) == [1, 0]  # an empty tank counts as nearly empty


def test_slots_stay_until_every_satellite_has_a_state() -> None:
    guidance = Guidance("/deputy1/guidance", parameters(assignment="delta_v", slot=2))
    states = on_the_ring(0.0)
    guidance.on_tick(estimate(states[0]), None, estimate(states[1]), None, estimate(states[3]))
    assert guidance.parameters.slot == 2
    guidance.on_tick(estimate(states[0], 1.0), None, estimate(states[1], 1.0), None, estimate(states[3], 1.0))
    (event,) = guidance.take_events()
    assert (event.kind, event.subject) == (EventKind.WARNING, "deputy3")
    guidance.on_tick(estimate(states[0], 2.0), None, *(estimate(state, 2.0) for state in states[1:]))
    assert [event.kind for event in guidance.take_events()] == [EventKind.ASSIGNMENT]
    guidance.on_tick(estimate(states[0], 3.0), None, *(estimate(state, 3.0) for state in states[1:]))
    assert guidance.take_events() == []


@pytest.mark.parametrize("state", [np.full(6, np.nan), np.full(6, 1e200), np.full(6, -np.inf)])
def test_implausible_state_counts_as_missing(state: Array) -> None:
    guidance = Guidance("/deputy1/guidance", parameters(assignment="delta_v", separation_warning=10.0))
    states = on_the_ring(0.0)
    target, separation = guidance.on_tick(estimate(state), None, *map(estimate, states[1:]))
    assert (separation, len(target.neighbours)) == (None, 3)
    others = estimate(state, 1.0), estimate(states[2], 1.0), estimate(states[3], 1.0)
    target, separation = guidance.on_tick(estimate(states[0], 1.0), None, *others)
    assert separation is not None
    assert np.isfinite([separation.planned, separation.passive]).all()
    assert target.neighbours.tolist() == states[2:].tolist()


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"fleet": ("deputy2", "deputy3")}, "deputy1 must be one of it"),
        ({"fleet": ("deputy1", "deputy1")}, "twice"),
        ({"fleet": (), "assignment": "delta_v"}, "without a fleet"),
        ({"projected_circular_orbit__satellites": 3, "assignment": "delta_v"}, "has 3 of the 4 slots"),
        ({"assignment": "fuel"}, "one for each"),
        (
            {
                "assignment": "delta_v",
                "schedule": ("{at: 9.0, formation: relative_orbit}",),
            },
            "has 1 of the 4 slots",
        ),
    ],
)
def test_invalid_fleet_is_rejected(values: dict[str, Any], reason: str) -> None:
    with pytest.raises(ConfigurationError, match=reason):
        Guidance("/deputy1/guidance", parameters(**values))


def test_one_deputy_cannot_change_an_assigned_formation() -> None:
    guidance = Guidance("/deputy1/guidance", parameters(assignment="delta_v"))
    with pytest.raises(ConfigurationError, match="by schedule only"):
        guidance.stage({"formation": "tetrahedral"})
    guidance.stage({"separation_warning": 5.0})


@pytest.mark.thorough
def test_fleet_commanded_one_by_one_changes_at_one_tick_to_one_assignment() -> None:
    fleet = fleet_of_four(assignment="delta_v", reconfiguration_time=500.0)
    states = on_the_ring(0.0)
    order = {"schedule": ["{at: 40.0, formation: tetrahedral}"]}
    for second in range(45):
        if second in (10, 20, 30, 39):
            guidance = fleet[FLEET[second // 10 - (second < 39)]]
            guidance.commit(guidance.stage(order))
        targets = fly(fleet, states, float(second))
        formation = RING["formation"] if second < 40 else "tetrahedral"
        assert {target.formation for target in targets} == {formation}
        states = np.array([target.relative_state for target in targets])
    assert sorted(guidance.parameters.slot for guidance in fleet.values()) == [0, 1, 2, 3]
    assert len({guidance.parameters.phase for guidance in fleet.values()}) == 1
    # a change during the reconfiguration is rejected, one after it may be scheduled
    guidance = fleet["deputy1"]
    for entry in ("{at: 539.0, formation: helix}", "{at: 539.0, phase: 1.0}"):
        with pytest.raises(ConfigurationError, match=r"at 539 s is not allowed; .* under way until 540 s"):
            guidance.stage({"schedule": [*order["schedule"], entry]})
    guidance.stage({"schedule": ["{at: 540.0, formation: helix}", "{at: 100.0, separation_warning: 9.0}"]})
    assert guidance.pending == ()
    assert guidance.parameters.formation == "tetrahedral"


def test_scheduled_change_within_the_time_of_the_previous_is_rejected() -> None:
    entries = "{at: 100.0, phase: 1.0}", "{at: 599.0, phase: 2.0}"
    with pytest.raises(ConfigurationError, match=r"at 599 s is not allowed; .* under way until 600 s"):
        Guidance("/deputy1/guidance", parameters(reconfiguration_time=500.0, schedule=entries))
    Guidance("/deputy1/guidance", parameters(reconfiguration_time=499.0, schedule=entries))


def test_planned_separation_has_neighbours_on_assigned_targets_or_coasting() -> None:
    off = np.zeros((4, 6))
    off[1:, 1] = 500.0  # an offset along the track stays in free motion
    values = {"preview_steps": 50, "preview_step": 60.0}
    found = {}
    for assignment in ("delta_v", "fixed"):
        fleet = fleet_of_four(assignment=assignment, **values)
        states = on_the_ring(0.3)
        if assignment == "fixed":
            fleet["deputy1"] = Guidance("/deputy1/guidance", parameters(phase=0.3, **values))
        else:
            fly(fleet, states)
        estimates = [estimate(state, 60.0) for state in propagated(states, 60.0) + off]
        _, separation = fleet["deputy1"].on_tick(estimates[0], None, *estimates[1:])
        assert separation is not None
        found[assignment] = separation
    # the side of the ring's square, sqrt(2) km, less for neighbours 500 m off
    assert found["delta_v"].planned == pytest.approx(1000.0 * math.sqrt(2.0), rel=2e-3)
    assert found["fixed"].planned == pytest.approx(found["fixed"].passive, rel=1e-3)
    assert found["fixed"].planned < 1100.0
    assert found["delta_v"].passive == pytest.approx(found["fixed"].passive)


def test_slot_occupied_by_a_neighbour_is_rejected_in_flight() -> None:
    states = on_the_ring(0.0)
    guidance = Guidance("/deputy1/guidance", parameters())
    guidance.on_tick(estimate(states[0]), None, *map(estimate, states[1:]))
    with pytest.raises(ConfigurationError, match="deputy3 is there"):
        guidance.stage({"slot": 2})
    assert guidance.parameters.slot == 0
    off = states + np.array([2.0, -3.0, 2.0, 0.001, 0.002, -0.001])  # control errors
    guidance.on_tick(estimate(off[0], 0.5), None, *(estimate(state, 0.5) for state in off[1:]))
    with pytest.raises(ConfigurationError, match="deputy3 is there"):
        guidance.stage({"slot": 2})
    guidance.stage({"slot": 2, "projected_circular_orbit.size": 1500.0})
    states[2, 3:] *= -1.0  # passes through, and does not occupy it
    guidance.on_tick(estimate(states[0], 1.0), None, *(estimate(state, 1.0) for state in states[1:]))
    guidance.stage({"slot": 2})
