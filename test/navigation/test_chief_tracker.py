"""The chief without its ephemeris: from an earlier one, with the deputy beside it."""

from dataclasses import replace

import numpy as np
import pytest

from formation_gnc.mode_records import CHIEF, STATE, Mode, ModeState, Restriction
from formation_gnc.navigation.chief_tracker import MEMORY, ChiefTracker
from formation_gnc.navigation.kernels import motion
from formation_gnc.navigation.step import step_constants
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative
from formation_gnc.records import EstimateStatus, EventKind
from formation_gnc.sil.monte_carlo import Sample, navigation_filter
from formation_gnc.sil.monte_carlo import simulate_measurements as simulate
from formation_gnc.types import NANOSECONDS, Vector

from .test_navigation_filter import LEO, parameters

TICK = 10.0
STEP = step_constants(round(TICK * NANOSECONDS), 1e-12)
RELATIVE = np.array([10.0, -100.0, 5.0, 0.0, 0.01, 0.0])


def orbit(ticks: int) -> list[Vector]:
    """True states of a chief, tick by tick."""
    states = [state_from_elements(Elements(**vars(LEO)))]
    for _ in range(ticks):
        states.append(motion.coast(states[-1], np.zeros(3), TICK, STEP.substeps))
    return states


def moved(chief: Vector, along: float, rate: float = 0.0) -> Vector:
    """The state of a point ahead of the chief, m, that moves on, m/s."""
    told: Vector = inertial_from_relative(chief, np.array([0.0, along, 0.0, 0.0, rate, 0.0]))
    return told


def restricted(*subjects: str) -> ModeState:
    return ModeState(
        0, Mode.KEEP, Mode.KEEP, 0, restrictions=[Restriction("sensor", each, "told") for each in subjects]
    )


def test_an_ephemeris_that_was_followed_away_is_gone_back_on() -> None:
    """A drift of 5 cm/s for 100 s: the chief is where it is, and the relative state, propagated beside it, is right."""
    states = orbit(60)
    tracker = ChiefTracker(states[0])
    for tick in range(1, 61):
        seconds = max(0, tick - 50) * TICK
        tracker.advance(moved(states[tick], 0.05 * seconds, 0.05) if seconds else states[tick], STEP)
    assert np.linalg.norm(tracker.state[:3] - states[60][:3]) == pytest.approx(5.0, rel=1e-3)
    age, relative = tracker.isolate(RELATIVE)
    assert MEMORY <= age <= 1.5 * MEMORY
    assert relative is RELATIVE
    # one integration over the age, instead of tick by tick
    assert np.linalg.norm(tracker.state[:3] - states[60][:3]) < 1e-3
    # whatever is told, it is propagated, and not lost
    tracker.advance(moved(states[60], 1e5), STEP)
    assert tracker.is_isolated
    assert not tracker.is_lost


def test_a_jump_that_was_taken_up_is_undone() -> None:
    """By 500 m at 50 ticks: the state was related to the other chief, and is related to the first one again."""
    states = orbit(60)
    tracker, relative = ChiefTracker(states[0]), RELATIVE
    for tick in range(1, 61):
        tracker.advance(moved(states[tick], 500.0) if tick >= 50 else states[tick], STEP)
        if tracker.is_lost:
            before = tracker.state
            if tracker.resume(STEP):
                relative = motion.change_chief(before, relative, tracker.state)
    assert relative[1] == pytest.approx(RELATIVE[1] - 500.0, abs=1.0)
    _, back = tracker.isolate(relative)
    # a point at rest in the Hill frame is on no free orbit beside the chief, and is propagated as if it were
    assert np.abs(back - RELATIVE)[:3].max() < 0.5


def samples(count: int) -> list[Sample]:
    return list(simulate(parameters(tick=TICK), count, np.random.default_rng(7)))


def test_a_filter_without_the_ephemeris_flies_as_with_a_good_one() -> None:
    """The chief drifts by 5 cm/s from tick 100 on, and is isolated at tick 110."""
    given = samples(400)
    filter = navigation_filter(parameters(tick=TICK))
    for number, sample in enumerate(given):
        measurement = sample.measurement
        if number > 100:
            told = moved(measurement.chief_state, (number - 100) * TICK * 0.05, 0.05)
            measurement = replace(measurement, chief_state=told)
        estimate = filter.on_tick(measurement, restricted(CHIEF) if number >= 110 else restricted())
        assert estimate is not None
    assert estimate.status == EstimateStatus.TRACKING
    apart = estimate.chief_state[:3] - given[-1].measurement.chief_state[:3]
    assert np.linalg.norm(apart) < 1.0  # 150 m by the ephemeris
    events = [each.detail for each in filter.take_events() if each.kind == EventKind.CHIEF]
    assert len(events) == 1
    assert events[0].startswith("ephemeris is isolated: propagated from that of ")


def test_a_state_that_is_not_trusted_is_given_up_once() -> None:
    """It waits for a fix, and goes on from it while it is still told."""
    given = samples(60)
    filter = navigation_filter(parameters(tick=TICK))
    answers = []
    for number, sample in enumerate(given):
        measurement = sample.measurement
        if number == 40:
            measurement = replace(measurement, fix_available=True, fix=given[0].measurement.fix)
        answers.append(filter.on_tick(measurement, restricted(STATE) if 30 <= number < 50 else restricted()))
    assert [number for number, each in enumerate(answers) if each is None] == [*range(30, 40)]
    assert answers[40] is not None
    assert answers[40].status == EstimateStatus.ACQUIRED


def test_a_state_begun_anew_is_about_the_chief_that_is_propagated() -> None:
    """Its ephemeris, which is isolated, is 5 km off when the fix comes."""
    given = samples(80)
    filter = navigation_filter(parameters(tick=TICK))
    for number, sample in enumerate(given):
        measurement = sample.measurement
        if number >= 30:
            measurement = replace(measurement, chief_state=moved(measurement.chief_state, 5000.0))
        if number == 52:
            measurement = replace(measurement, fix_available=True, fix=given[0].measurement.fix)
        subjects = [CHIEF] * (number >= 40) + [STATE] * (50 <= number < 54)
        estimate = filter.on_tick(measurement, restricted(*subjects))
    assert estimate is not None
    assert np.linalg.norm(estimate.chief_state[:3] - given[-1].measurement.chief_state[:3]) < 1.0
