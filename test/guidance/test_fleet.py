"""What a guidance does in a fleet: others in its target, predicted separations, shared places."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.guidance import Guidance, GuidanceParameters, check_places
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
    guides: Mapping[str, Guidance],
    states: Array,
    seconds: float = 0.0,
    masses: tuple[float, ...] = (100.0,) * 4,
) -> list[Target]:
    """One tick of all guidances."""
    seen = {name: estimate(state, seconds, mass) for name, state, mass in zip(guides, states, masses, strict=True)}
    return [
        guide.on_tick(seen[name], *(seen[other] for other in guide.neighbours))[0] for name, guide in guides.items()
    ]


def guides(**values: Any) -> dict[str, Guidance]:
    return {name: Guidance(f"/{name}/guidance", parameters(**values)) for name in FLEET}


def on_the_ring(phase: float) -> Array:
    """States of the four on their own places of a ring."""
    found = [
        Guidance("/deputy1/guidance", parameters(slot=slot, phase=phase)).configuration.design.states(np.zeros(1))[0]
        for slot in range(4)
    ]
    return np.array(found)


def propagated(states: Array, seconds: float) -> Array:
    """Free motion under Hill's equations."""
    moved: Array = states @ HillModel(parameters().mean_motion).transition(0.0, seconds).T
    return moved


def test_the_others_come_with_the_target_in_the_order_of_the_fleet() -> None:
    states = on_the_ring(0.0)
    guide = Guidance("/deputy2/guidance", parameters(slot=1))
    assert guide.neighbours == ("deputy1", "deputy3", "deputy4")
    target, _ = guide.on_tick(estimate(states[1]), estimate(states[0]), None, estimate(states[3]))
    assert target.neighbours.tolist() == [states[0].tolist(), states[3].tolist()]
    broken, _ = guide.on_tick(
        estimate(states[1], 1.0), estimate(states[0], 1.0), estimate(np.full(6, np.nan), 1.0), None
    )
    assert broken.neighbours.tolist() == [states[0].tolist()]


def test_alone_there_is_nobody_and_nothing_to_predict() -> None:
    target, separation = Guidance("/deputy1/guidance", parameters(fleet=())).on_tick(estimate(np.ones(6)))
    assert target.neighbours.shape == (0, 6)
    assert separation is None


def test_neighbours_on_a_ring_are_predicted_to_keep_the_side_of_its_square() -> None:
    states = on_the_ring(0.3)
    guide = Guidance("/deputy1/guidance", parameters(phase=0.3, preview_steps=50, preview_step=60.0))
    _, separation = guide.on_tick(*map(estimate, states))
    assert separation is not None
    # positions at right angles on y^2 + z^2 = 1 km, radially up to half as much more: |d|^2 = 2 + (dx)^2 with
    # dx of amplitude sqrt(2)/2, zero four times in two revolutions
    assert separation.passive == pytest.approx(1000.0 * math.sqrt(2.0), rel=2e-3)
    assert separation.planned == pytest.approx(1000.0 * math.sqrt(2.0), rel=2e-3)
    assert separation.passive_neighbour in ("deputy2", "deputy4")


def test_a_collision_course_is_found_between_the_points_and_told_once() -> None:
    guide = Guidance("/deputy1/guidance", parameters(fleet=("deputy1", "deputy2"), separation_warning=20.0))
    n = guide.parameters.mean_motion
    behind, ahead = np.zeros(6), np.zeros(6)
    behind[1], ahead[1] = -1000.0, 1000.0
    drifting = ahead.copy()
    drifting[0] = 2000.0 / (3.0 * math.pi)
    # x = c, y' = -3/2 n c is free motion that falls back 3 pi c in a revolution: as far as the other one
    drifting[4] = -1.5 * n * drifting[0]
    _, separation = guide.on_tick(estimate(behind), estimate(drifting))
    assert separation is not None
    assert separation.passive == pytest.approx(drifting[0], rel=1e-6)  # passes above at that height
    assert separation.passive_time / NANOSECONDS == pytest.approx(2000.0 / (1.5 * n * drifting[0]), rel=1e-6)
    assert not [event for event in guide.take_events() if event.kind == EventKind.SEPARATION]
    drifting[0] *= 0.04
    drifting[4] *= 0.04
    drifting[1] = -900.0
    assert guide.on_tick(estimate(behind, 30.0), estimate(drifting, 30.0))[1] is None  # not due yet
    told = []
    for seconds in (60.0, 120.0):
        _, separation = guide.on_tick(estimate(behind, seconds), estimate(drifting, seconds))
        assert separation is not None
        assert separation.passive < 20.0
        told += [event.detail for event in guide.take_events() if event.kind == EventKind.SEPARATION]
    assert len(told) == 1
    guide.on_tick(estimate(behind, 180.0), estimate(ahead, 180.0))
    assert [event.detail for event in guide.take_events() if event.kind == EventKind.SEPARATION] == ["over"]


@pytest.mark.parametrize("model", ["hill", "j2_mean_motion", "yamanaka_ankersen"])
def test_all_guidances_of_a_fleet_find_the_same_places_and_the_phase_where_they_are(model: str) -> None:
    order = [2, 0, 3, 1]
    states = on_the_ring(1.234)[order]
    fleet = guides(assignment="delta_v", model=model)
    targets = fly(fleet, states)
    phases = {guide.parameters.phase for guide in fleet.values()}
    assert len(phases) == 1
    assert sorted(guide.parameters.slot for guide in fleet.values()) == [0, 1, 2, 3]
    # on the ring already, and so at home; the rates of J2 make the start a little different
    off = [np.linalg.norm((target.relative_state - state)[:3]) for target, state in zip(targets, states, strict=True)]
    assert max(off) < (1e-2 if model == "hill" else 5.0)
    assert [event.kind for event in fleet["deputy1"].take_events()] == [EventKind.ASSIGNMENT]


def test_places_are_shared_out_again_when_the_schedule_changes_the_formation() -> None:
    change = "{at: 100.0, formation: three_in_plane_one_out}"
    fleet = guides(assignment="delta_v", formation="tetrahedral", schedule=(change,))
    start = on_the_ring(0.0)
    before = fly(fleet, start)
    states = np.array([target.relative_state for target in before])
    after = fly(fleet, states, 100.0)
    assert {target.formation for target in after} == {"three_in_plane_one_out"}
    assert sorted(guide.parameters.slot for guide in fleet.values()) == [0, 1, 2, 3]
    kinds = [event.kind for event in fleet["deputy3"].take_events()]
    expected = [EventKind.ASSIGNMENT, EventKind.PARAMETERS, EventKind.ASSIGNMENT, EventKind.RECONFIGURATION]
    assert kinds == expected


def test_with_fuel_who_has_little_left_goes_the_shorter_way() -> None:
    # places 1 and 2 km behind: both satellites are nearer to the far one, deputy2 by more
    values: dict[str, Any] = {
        "fleet": ("deputy1", "deputy2"),
        "formation": "leader_follower",
        "leader_follower__separation": 1000.0,
        "dry_masses": (90.0, 90.0),
    }
    states = np.zeros((2, 6))
    states[:, 1] = -1600.0, -1700.0

    def places(assignment: str, masses: tuple[float, float]) -> list[int]:
        fleet = {
            name: Guidance(f"/{name}/guidance", parameters(**values, assignment=assignment))
            for name in ("deputy1", "deputy2")
        }
        fly(fleet, states, masses=masses)
        return [guide.parameters.slot for guide in fleet.values()]

    assert places("delta_v", (91.0, 99.0)) == [0, 1]  # 600 m and 300 m
    assert places("fuel", (99.0, 99.0)) == [0, 1]
    assert places("fuel", (91.0, 99.0)) == [1, 0]  # 400 m and 700 m
    assert places("fuel", (90.0, 99.0)) == [1, 0]  # an empty tank counts as nearly empty


def test_places_stay_until_there_is_a_state_of_everybody() -> None:
    guide = Guidance("/deputy1/guidance", parameters(assignment="delta_v", slot=2))
    states = on_the_ring(0.0)
    guide.on_tick(estimate(states[0]), estimate(states[1]), None, estimate(states[3]))
    assert guide.parameters.slot == 2
    guide.on_tick(estimate(states[0], 1.0), estimate(states[1], 1.0), None, estimate(states[3], 1.0))
    (event,) = guide.take_events()
    assert (event.kind, event.subject) == (EventKind.WARNING, "deputy3")
    guide.on_tick(estimate(states[0], 2.0), *(estimate(state, 2.0) for state in states[1:]))
    assert [event.kind for event in guide.take_events()] == [EventKind.ASSIGNMENT]
    guide.on_tick(estimate(states[0], 3.0), *(estimate(state, 3.0) for state in states[1:]))
    assert guide.take_events() == []


@pytest.mark.parametrize("state", [np.full(6, np.nan), np.full(6, 1e200), np.full(6, -np.inf)])
def test_a_state_that_nobody_can_have_is_nobodys(state: Array) -> None:
    guide = Guidance("/deputy1/guidance", parameters(assignment="delta_v", separation_warning=10.0))
    states = on_the_ring(0.0)
    target, separation = guide.on_tick(estimate(state), *map(estimate, states[1:]))
    assert (separation, len(target.neighbours)) == (None, 3)
    others = estimate(state, 1.0), estimate(states[2], 1.0), estimate(states[3], 1.0)
    target, separation = guide.on_tick(estimate(states[0], 1.0), *others)
    assert separation is not None
    assert np.isfinite([separation.planned, separation.passive]).all()
    assert target.neighbours.tolist() == states[2:].tolist()


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"fleet": ("deputy2", "deputy3")}, "deputy1 must be one of it"),
        ({"fleet": ("deputy1", "deputy1")}, "twice"),
        ({"fleet": (), "assignment": "delta_v"}, "without a fleet"),
        ({"projected_circular_orbit__satellites": 3, "assignment": "delta_v"}, "3 places for a fleet of 4"),
        ({"assignment": "fuel"}, "one for each"),
        (
            {
                "assignment": "delta_v",
                "schedule": ("{at: 9.0, formation: relative_orbit}",),
            },
            "1 places for a fleet of 4",
        ),
    ],
)
def test_a_fleet_that_cannot_be_is_rejected(values: dict[str, Any], reason: str) -> None:
    with pytest.raises(ConfigurationError, match=reason):
        Guidance("/deputy1/guidance", parameters(**values))


def test_one_alone_may_not_change_what_is_shared_out() -> None:
    guide = Guidance("/deputy1/guidance", parameters(assignment="delta_v"))
    with pytest.raises(ConfigurationError, match="by schedule only"):
        guide.stage({"formation": "tetrahedral"})
    guide.stage({"separation_warning": 5.0})


def test_a_fleet_that_is_told_one_after_the_other_changes_at_one_tick_to_places_of_one_mind() -> None:
    fleet = guides(assignment="delta_v", reconfiguration_time=500.0)
    states = on_the_ring(0.0)
    order = {"schedule": ["{at: 40.0, formation: tetrahedral}"]}
    for second in range(45):
        if second in (10, 20, 30, 39):
            guide = fleet[FLEET[second // 10 - (second < 39)]]
            guide.commit(guide.stage(order))
        targets = fly(fleet, states, float(second))
        formation = RING["formation"] if second < 40 else "tetrahedral"
        assert {target.formation for target in targets} == {formation}
        states = np.array([target.relative_state for target in targets])
    assert sorted(guide.parameters.slot for guide in fleet.values()) == [0, 1, 2, 3]
    assert len({guide.parameters.phase for guide in fleet.values()}) == 1
    # while that is under way, nothing else is; what comes after it may be foreseen
    guide = fleet["deputy1"]
    for entry in ("{at: 539.0, formation: helix}", "{at: 539.0, phase: 1.0}"):
        with pytest.raises(ConfigurationError, match=r"at 539 s is not allowed; .* under way until 540 s"):
            guide.stage({"schedule": [*order["schedule"], entry]})
    guide.stage({"schedule": ["{at: 540.0, formation: helix}", "{at: 100.0, separation_warning: 9.0}"]})
    assert [foreseen for foreseen, _ in guide.foreseen] == []
    assert guide.parameters.formation == "tetrahedral"


def test_two_scheduled_changes_of_which_the_second_comes_too_soon_are_rejected_before_the_flight() -> None:
    entries = "{at: 100.0, phase: 1.0}", "{at: 599.0, phase: 2.0}"
    with pytest.raises(ConfigurationError, match=r"at 599 s is not allowed; .* under way until 600 s"):
        Guidance("/deputy1/guidance", parameters(reconfiguration_time=500.0, schedule=entries))
    Guidance("/deputy1/guidance", parameters(reconfiguration_time=499.0, schedule=entries))


def test_where_places_are_shared_out_the_others_are_predicted_on_their_targets_and_else_to_coast() -> None:
    off = np.zeros((4, 6))
    off[1:, 1] = 500.0  # along the track, where it is free motion too
    values = {"preview_steps": 50, "preview_step": 60.0}
    found = {}
    for assignment in ("delta_v", "fixed"):
        fleet = guides(assignment=assignment, **values)
        states = on_the_ring(0.3)
        if assignment == "fixed":
            fleet["deputy1"] = Guidance("/deputy1/guidance", parameters(phase=0.3, **values))
        else:
            fly(fleet, states)
        seen = [estimate(state, 60.0) for state in propagated(states, 60.0) + off]
        _, separation = fleet["deputy1"].on_tick(*seen)
        assert separation is not None
        found[assignment] = separation
    # the side of the ring's square, sqrt(2) km, or what is left of it for who is 500 m off
    assert found["delta_v"].planned == pytest.approx(1000.0 * math.sqrt(2.0), rel=2e-3)
    assert found["fixed"].planned == pytest.approx(found["fixed"].passive, rel=1e-3)
    assert found["fixed"].planned < 1100.0
    assert found["delta_v"].passive == pytest.approx(found["fixed"].passive)


def test_a_fleet_at_odds_is_rejected_at_the_start() -> None:
    shared = parameters(assignment="delta_v")
    check_places(dict.fromkeys(FLEET, shared))
    check_places(dict.fromkeys(FLEET, shared) | {"deputy4": parameters(assignment="delta_v", slot=3)})
    with pytest.raises(ConfigurationError, match="must be the same"):
        check_places(dict.fromkeys(FLEET, shared) | {"deputy4": parameters(slot=3)})
    with pytest.raises(ConfigurationError, match="deputy4, who must be"):
        check_places(dict.fromkeys(FLEET[:3], shared))
    with pytest.raises(ConfigurationError, match="on one place"):
        check_places(dict.fromkeys(FLEET, parameters()))


def test_a_place_that_another_holds_is_rejected_in_flight_and_the_target_stays() -> None:
    states = on_the_ring(0.0)
    guide = Guidance("/deputy1/guidance", parameters())
    guide.on_tick(*map(estimate, states))
    with pytest.raises(ConfigurationError, match="deputy3 is there"):
        guide.stage({"slot": 2})
    assert guide.parameters.slot == 0
    off = states + np.array([2.0, -3.0, 2.0, 0.001, 0.002, -0.001])  # as control keeps it
    guide.on_tick(*(estimate(state, 0.5) for state in off))
    with pytest.raises(ConfigurationError, match="deputy3 is there"):
        guide.stage({"slot": 2})
    guide.stage({"slot": 2, "projected_circular_orbit.size": 1500.0})
    states[2, 3:] *= -1.0  # passes through, and does not hold it
    guide.on_tick(*(estimate(state, 1.0) for state in states))
    guide.stage({"slot": 2})
