"""Monitors one by one, on records made by hand, and all of them on bad input."""

from collections.abc import Iterator
from dataclasses import replace
from math import isnan, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.common import Orbit
from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import (
    Estimate,
    EstimateStatus,
    Innovation,
    Measurement,
    Reading,
    Rejection,
    Separation,
    Status,
    Target,
    Thrust,
)
from formation_gnc.supervision.health import Health
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Level, Monitor, Observation, Verdict
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.registry import MONITORS, table
from formation_gnc.types import NANOSECONDS, Vector

ORBIT = Orbit(7.0e6)
TICK = 1.0
Records = tuple[Measurement | None, Estimate | None, Target | None, Status | None, Thrust | None]


def parameters(**changes: Any) -> SupervisorParameters:
    values: dict[str, Any] = {"chief": ORBIT, "tick": TICK, "duration": 5000.0}
    return SupervisorParameters(**values | changes)


def chiefs(count: int) -> Iterator[Vector]:
    """Inertial states (6,) of a chief, tick by tick."""
    propagator = Propagator(TICK)
    states = state_from_elements(Elements(**vars(ORBIT)))[None]
    for _ in range(count):
        yield states[0]
        states = propagator.propagate(0.0, states, np.zeros((1, 3)), np.ones(1))


CHIEFS = list(chiefs(600))


def records(tick: int, **changes: Any) -> Records:
    """A tick without a fault, 100 m behind the chief, with readings every ten ticks."""
    time = round(tick * TICK * NANOSECONDS)
    random = np.random.default_rng(tick)
    chief = CHIEFS[tick % len(CHIEFS)]
    state = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 1e-12 * tick])  # no filter gives the same bits again
    sensors = ("radius", "range_rate", "latitude") if tick % 10 == 0 else ()
    noise = random.standard_normal(len(sensors)).tolist()
    measurement = Measurement(
        time,
        "deputy1",
        chief,
        [Reading(name, [each], 0) for name, each in zip(sensors, noise, strict=True)],
        np.zeros(3),
        100.0,
        False,
        False,
        np.zeros(6),
    )
    innovations = [Innovation(name, [each], [1.0], 0.2) for name, each in zip(sensors, noise, strict=True)]
    estimate = Estimate(
        time,
        state,
        chief,
        100.0,
        np.diag([0.25] * 3 + [2.5e-7] * 3),
        False,
        innovations,
        sum(each**2 for each in noise),
        int(EstimateStatus.TRACKING),
    )
    target = Target(time, "leader_follower", state, 0, np.empty((0, 6)))
    status = Status(time, "lqr", np.zeros(3), [False] * 3)
    whole: Records = (
        replace(measurement, **changes.get("measurement", {})),
        replace(estimate, **changes.get("estimate", {})),
        replace(target, **changes.get("target", {})),
        replace(status, **changes.get("status", {})),
        replace(Thrust(time, np.zeros(3)), **changes.get("thrust", {})),
    )
    return whole


def feed(health: Health, tick: int, mode: Mode = Mode.KEEP, **changes: Any) -> None:
    health.feed(round(tick * TICK * NANOSECONDS), mode, *records(tick, **changes))


def level(health: Health, monitor: str, subject: str = "") -> Level:
    found = {(each.monitor, each.subject): each.level for each in health.verdicts()}
    return found.get((monitor, subject), Level.OK)


def failed(health: Health) -> set[str]:
    return {each.monitor for each in health.verdicts() if each.level is Level.FAILED}


def test_a_clean_run_fails_nothing() -> None:
    health = Health(parameters())
    for tick in range(200):
        feed(health, tick)
    assert failed(health) == set()


def test_a_reading_delivered_twice_is_not_frozen() -> None:
    health = Health(parameters())
    for tick in range(50):
        age = tick % 10 * NANOSECONDS
        feed(health, tick, measurement={"readings": [Reading("radius", [tick // 10 * 1.5], age)]})
    assert level(health, "frozen_readings", "radius") is Level.OK


def test_a_sensor_that_never_reads_is_told_after_ten_minutes() -> None:
    health = Health(parameters())
    for tick in range(0, 590):
        feed(health, tick, measurement={"readings": []})
    assert level(health, "dropout", "radius") is not Level.FAILED
    for tick in range(590, 601):
        feed(health, tick, measurement={"readings": []})
    assert level(health, "dropout", "radius") is Level.FAILED


def test_a_sensor_that_drops_out_at_random_is_not_a_failure() -> None:
    """Every fourth reading is missing: nine in a row would be once in a thousand flights of this length."""
    health, random = Health(parameters()), np.random.default_rng(3)
    for tick in range(5000):
        lacks: Any = {"measurement": {"readings": []}} if tick % 10 == 0 and random.random() < 0.25 else {}
        feed(health, tick, **lacks)
    assert level(health, "dropout", "radius") is not Level.FAILED


def test_what_the_gate_refuses_counts_for_bias_and_consistency() -> None:
    health = Health(parameters())
    refused = [Innovation("radius", [80.0], [1.0], 16.0, Rejection.GATE)]
    for tick in range(0, 200):
        feed(health, tick, estimate={"innovations": refused if tick % 10 == 0 else [], "nis": 0.0})
    assert level(health, "innovation_bias", "radius") is Level.FAILED
    assert level(health, "innovation_consistency") is Level.FAILED


@pytest.mark.parametrize("told", [0.0, 0.01, nan])
@pytest.mark.parametrize("axis", range(3))
def test_a_force_that_is_not_as_commanded_is_named_by_axis(told: float, axis: int) -> None:
    """Stuck off, stuck on, not told: within four ticks of a difference of the whole limit."""
    health = Health(parameters())
    force, commanded = np.zeros(3), np.zeros(3)
    force[axis], commanded[axis] = told, 0.01 - told if told == told else 0.0
    for tick in range(20, 26):
        feed(health, tick, measurement={"applied_force": force}, thrust={"force": commanded})
    for other, name in enumerate("xyz"):
        assert level(health, "thrust_response", name) is (Level.FAILED if other == axis else Level.OK)


def test_a_lag_and_a_scale_within_the_allowance_are_no_fault() -> None:
    """The force follows the command with half a tick of lag and at 92 %."""
    health, random = Health(parameters()), np.random.default_rng(5)
    before, commanded = np.zeros(3), np.zeros(3)
    for tick in range(3000):
        applied = 0.92 * (before + commanded) / 2.0
        before, commanded = commanded, 0.01 * random.uniform(-1.0, 1.0, 3)
        feed(health, tick, measurement={"applied_force": applied}, thrust={"force": commanded})
        assert level(health, "thrust_response", "x") is not Level.FAILED


def test_no_thrust_in_eclipse_is_as_expected_where_it_is_configured() -> None:
    for configured, expected in ((True, Level.OK), (False, Level.FAILED)):
        health = Health(parameters(off_in_eclipse=configured))
        for tick in range(50):
            feed(health, tick, measurement={"eclipse": True}, thrust={"force": np.full(3, 0.01)})
        assert level(health, "thrust_response", "x") is expected


def test_mass_follows_the_propellant_used() -> None:
    """1 N from a specific impulse of 100 s takes 1.02 g/s: over 1000 s, 1 % of 100 kg."""
    health = Health(parameters(specific_impulse=100.0, thrust_limit=(1.0, 1.0, 1.0), mass=20.0))
    force = np.array([1.0, 0.0, 0.0])
    for tick in range(1001):
        mass = 20.0 - tick * 1.0 / (100.0 * 9.80665)
        changes = {"applied_force": force if tick else np.zeros(3), "mass": mass}
        feed(health, tick, measurement=changes, thrust={"force": force})
    assert level(health, "mass") is Level.OK
    for tick in range(1001, 1201):  # the tank is told as full again
        feed(health, tick, measurement=changes | {"mass": 20.0}, thrust={"force": force})
    assert level(health, "mass") is Level.FAILED


@pytest.mark.parametrize(
    ("first", "later", "expected"),
    [(103.0, 103.0, Level.OK), (103.0, 100.0, Level.FAILED), (120.0, 120.0, Level.FAILED)],
)
def test_an_initial_mass_that_is_known_badly_is_no_fault(first: float, later: float, expected: Level) -> None:
    health = Health(parameters())
    for tick in range(30):
        feed(health, tick, measurement={"mass": first if tick < 15 else later})
    assert level(health, "mass") is expected


def test_a_supervisor_that_starts_in_flight_takes_a_mass_that_can_be() -> None:
    health = Health(parameters(specific_impulse=100.0, thrust_limit=(1.0, 1.0, 1.0)))
    for tick in range(5000, 5020):
        feed(health, tick, measurement={"mass": 90.0})
    assert level(health, "mass") is Level.OK


def test_an_estimate_that_jumps_is_told_and_one_that_starts_anew_is_not() -> None:
    """100 m off from one tick to the next, at a standard deviation of half a metre."""
    moved = np.array([0.0, 0.0, 100.0, 0.0, 0.0, 0.0]) + records(0)[1].relative_state  # type: ignore[union-attr]
    for status, expected in ((EstimateStatus.TRACKING, Level.FAILED), (EstimateStatus.ACQUIRED, Level.OK)):
        health = Health(parameters())
        for tick in range(35):
            feed(health, tick)
        feed(health, 35, estimate={"relative_state": moved, "status": int(status)})
        for tick in range(36, 41):
            feed(health, tick, estimate={"relative_state": moved})
        assert level(health, "estimate_jump") is expected


def test_thrust_within_the_interval_is_no_jump() -> None:
    """0.01 m/s^2 over three ticks in the middle of an interval moves the state by more than a sigma."""
    health, acceleration = Health(parameters()), np.array([0.0, 0.0, 0.01])
    state, fired = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(3)
    for tick in range(41):
        feed(health, tick, estimate={"relative_state": state}, measurement={"applied_force": 100.0 * fired})
        fired = acceleration if 31 <= tick < 34 else np.zeros(3)
        position, velocity = state[:3] + state[3:] * TICK + 0.5 * fired * TICK**2, state[3:] + fired * TICK
        state = np.concatenate([position, velocity])
    (verdict,) = [each for each in health.verdicts() if each.monitor == "estimate_jump"]
    assert verdict.statistic < 0.1


def test_control_error_is_told_when_it_leaves_the_tube_twice_over() -> None:
    for free, expected in ((True, Level.FAILED), (False, Level.OK)):
        health = Health(parameters(tube=10.0))
        for tick in range(0, 200):
            error = np.array([0.0, -100.0 - 0.15 * tick, 0.0, 0.0, 0.0, 0.0])
            saturated = not free and tick > 50
            feed(health, tick, estimate={"relative_state": error}, status={"saturated": [saturated, False, False]})
        assert level(health, "control_error") is (expected if free else level(health, "control_error"))
        assert (level(health, "control_error") is Level.FAILED) == (expected is Level.FAILED) or not free


def test_a_new_formation_is_no_control_error() -> None:
    health = Health(parameters(tube=10.0))
    for tick in range(0, 100):
        feed(health, tick)
    far = np.array([0.0, -300.0, 0.0, 0.0, 0.0, 0.0])
    for tick in range(100, 200):
        feed(health, tick, target={"formation": "helix", "relative_state": far})
    assert level(health, "control_error") is Level.OK


def test_a_target_that_leaps_is_to_be_reached_anew() -> None:
    """The same formation, made larger at once: 200 m off is no error that has grown."""
    health, far = Health(parameters(tube=10.0)), np.array([0.0, -300.0, 0.0, 0.0, 0.0, 0.0])
    for tick in range(0, 300):
        feed(health, tick, target={"relative_state": far} if tick >= 100 else {})
    assert level(health, "control_error") is Level.OK
    for tick in range(300, 500):  # it is reached, and left again
        off = 0.0 if tick < 400 else 30.0
        feed(
            health,
            tick,
            target={"relative_state": far},
            estimate={"relative_state": far + off * np.eye(6)[0]},
        )
    assert level(health, "control_error") is Level.FAILED


@pytest.mark.parametrize(
    ("monitor", "changes", "revolutions"),
    [
        ("solver_fallback", {"status": {"fallback": "solver failed"}}, 0.02),
        ("saturation", {"status": {"saturated": [True, False, False]}}, 0.5),
        ("thruster_on", {"measurement": {"applied_force": np.array([0.005, 0.0, 0.0])}}, 0.5),
    ],
)
def test_what_is_normal_for_a_while_is_told_after_its_bound(monitor: str, changes: Any, revolutions: float) -> None:
    health, settings = Health(parameters()), parameters()
    bound = revolutions * 2.0 * np.pi / settings.mean_motion
    subject = "x" if monitor == "thruster_on" else ""
    for tick in range(0, int(bound) - 10, 10):
        feed(health, tick, **changes)
    assert level(health, monitor, subject) is not Level.FAILED
    for tick in range(int(bound) - 10, int(bound) + 61):
        feed(health, tick, **changes)
    assert level(health, monitor, subject) is Level.FAILED
    for tick in range(int(bound) + 61, int(bound) + 121):
        feed(health, tick)
    assert level(health, monitor, subject) is Level.OK


def test_a_state_is_to_be_known_better_in_keep_than_in_acquire() -> None:
    health = Health(parameters(largest_sigma=5.0))
    wide = {"covariance": np.diag([64.0] * 3 + [1e-6] * 3)}
    feed(health, 10, Mode.ACQUIRE, estimate=wide)
    assert level(health, "covariance") is Level.OK
    feed(health, 20, Mode.KEEP, estimate=wide)
    assert level(health, "covariance") is Level.FAILED
    feed(health, 30, Mode.SAFE, estimate=wide)
    assert level(health, "covariance") is Level.OK


BAD = (nan, float("inf"), -1e300, 0.0)


@given(
    st.lists(
        st.tuples(
            st.integers(-3, 12),
            st.sampled_from(Mode),
            st.sampled_from(BAD),
            st.sets(st.integers(0, 4)),
            st.integers(0, 11),
        ),
        min_size=5,
        max_size=40,
    )
)
def test_monitors_stand_bad_missing_and_unordered_records(ticks: list[Any]) -> None:
    """Numbers that are none, records that are absent, ticks that are missed, doubled or out of order."""
    health, tick = Health(parameters(specific_impulse=50.0)), 20
    for step, mode, bad, absent, kind in ticks:
        tick = max(0, tick + step)
        changes: Any = [
            {"measurement": {"chief_state": np.full(6, bad)}},
            {"measurement": {"applied_force": np.full(3, bad)}},
            {"measurement": {"mass": bad}},
            {"measurement": {"readings": [Reading("radius", [bad], 0), Reading("radius", [], 5)]}},
            {"estimate": {"relative_state": np.full(6, bad)}},
            {"estimate": {"covariance": np.full((6, 6), bad)}},
            {"estimate": {"innovations": [Innovation("radius", [bad, bad], [bad], bad)], "nis": bad}},
            {"estimate": {"chief_state": np.full(6, bad)}},
            {"target": {"relative_state": np.full(6, bad)}},
            {"thrust": {"force": np.full(3, bad)}},
            {"status": {"saturated": [], "fallback": "x"}},
            {},
        ][kind]
        given = [None if place in absent else each for place, each in enumerate(records(tick, **changes))]
        time = round(tick * TICK * NANOSECONDS)
        before = list(health.verdicts())
        if not health.feed(time, mode, *given):  # type: ignore[arg-type]
            assert list(health.verdicts()) == before
    for verdict in health.verdicts():
        assert not isnan(verdict.statistic)
        assert verdict.threshold > 0.0
        assert verdict.subject in MONITORS[verdict.monitor].subjects(parameters())


def test_two_supervisors_with_the_same_input_say_the_same() -> None:
    said: list[list[Verdict]] = []
    for _ in range(2):
        health = Health(parameters())
        for tick in range(100):
            feed(health, tick)
        said.append(list(health.verdicts()))
    assert said[0] == said[1]


def test_a_monitor_is_one_class_and_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    class Cold(Monitor):
        """Mass below what there was, as a toy."""

        name = "cold"
        title = "toy"
        test = "bound"

        def feed(self, observation: Observation) -> None:
            if observation.measurement is not None:
                self.judge("", 100.5 - observation.measurement.mass, 0.5, 1.0)

    monkeypatch.setitem(MONITORS, "cold", Cold)
    health = Health(parameters())
    feed(health, 10)
    assert level(health, "cold") is Level.SUSPECT
    assert "| `cold` | toy | bound |" in table()


def test_every_monitor_states_what_it_assumes_or_cannot_see_and_its_delay() -> None:
    for name, monitor in MONITORS.items():
        assert monitor.name == name
        documentation = monitor.__doc__ or ""
        inherited = monitor.__mro__[1].__doc__ or ""
        for heading in ("Cannot see:", "Delay:"):
            assert heading in documentation + inherited, f"{name} lacks {heading!r}"


def test_thrust_that_is_told_as_off_is_found_by_its_acceleration() -> None:
    """0.1 mm/s^2 along the normal, told as none: the propagated rate is off by 30 mm/s after five minutes."""
    health, push, n = Health(parameters()), 1e-4, parameters().mean_motion
    settled = 200
    for tick in range(600):
        t = max(0.0, (tick - settled) * TICK)
        z, vz = push / n**2 * (1.0 - np.cos(n * t)), push / n * np.sin(n * t)
        state = np.array([0.0, -100.0, z, 0.0, 0.0, vz])
        feed(health, tick, estimate={"relative_state": state})
        if tick < settled:
            assert level(health, "residual_acceleration", "z") is Level.OK
    assert level(health, "residual_acceleration", "z") is Level.FAILED
    assert level(health, "residual_acceleration", "x") is Level.OK


def test_propellant_that_does_not_last_is_told_after_a_revolution() -> None:
    """10 mN all the time take 59 g a revolution at 100 s: for 60 revolutions a kilogram is not enough."""
    for dry_mass, expected in ((0.0, Level.OK), (99.0, Level.FAILED)):
        settings = parameters(specific_impulse=100.0, dry_mass=dry_mass, tick=60.0, duration=60.0 * 5828.0)
        health = Health(settings)
        for tick in range(110):
            measured = {"applied_force": np.array([0.0, 0.01, 0.0]), "mass": 100.0 - 6e-4 * tick}
            health.feed(tick * settings.tick_ns, Mode.KEEP, *records(tick, measurement=measured))
        assert level(health, "propellant") is expected


def test_a_separation_is_low_by_its_distance_and_its_uncertainty() -> None:
    """At a limit of 20 m: 19 m ahead is too close; 30 m in two hours is, since it may drift by 40 m until then."""
    for planned, passive, expected in ((19.0, 500.0, "planned"), (100.0, 30.0, "passive"), (100.0, 500.0, "")):
        health = Health(parameters(least_separation=20.0))
        given = Separation(0, planned, 0, "deputy2", passive, 7200 * NANOSECONDS, "deputy2")
        health.feed(0, Mode.KEEP, *records(0, target={"separation": [given]}))
        for subject in ("planned", "passive"):
            assert (level(health, "separation", subject) is Level.FAILED) == (subject == expected)


def test_a_neighbour_that_falls_silent_is_told_after_a_minute() -> None:
    health = Health(parameters())
    for tick in range(200):
        count = 3 if tick < 100 else 2
        feed(health, tick, target={"neighbours": np.zeros((count, 6))})
        assert (level(health, "neighbours") is Level.FAILED) == (tick >= 160)


@pytest.mark.parametrize(
    ("silent", "name"), [((1, 2, 3, 4), "navigation"), ((2, 3, 4), "guidance"), ((3, 4), "controller")]
)
def test_the_first_module_that_does_not_answer_is_named(silent: tuple[int, ...], name: str) -> None:
    health = Health(parameters())
    for tick in range(200):
        given = [None if tick >= 100 and place in silent else each for place, each in enumerate(records(tick))]
        health.feed(round(tick * TICK * NANOSECONDS), Mode.KEEP, *given)  # type: ignore[arg-type]
    for module in ("navigation", "guidance", "controller"):
        assert level(health, "heartbeat", module) is (Level.FAILED if module == name else Level.OK)


def test_missed_ticks_are_counted_over_a_hundred() -> None:
    health = Health(parameters())
    for tick in range(0, 100):
        feed(health, tick)
    for tick in range(100, 118, 2):
        feed(health, tick)
    assert level(health, "cycle_slips") is not Level.FAILED
    feed(health, 125)
    assert level(health, "cycle_slips") is Level.FAILED
    for tick in range(126, 241):
        feed(health, tick)
    assert level(health, "cycle_slips") is Level.OK


def test_a_law_that_is_told_to_coast_has_no_control_error() -> None:
    for law, expected in (("lqr", Level.FAILED), ("coast", Level.OK)):
        health = Health(parameters(tube=10.0))
        for tick in range(400):
            state = np.array([0.0, -100.0 - 0.1 * tick, 0.0, 0.0, 0.0, 0.0])
            feed(health, tick, estimate={"relative_state": state}, status={"algorithm": law})
        assert level(health, "control_error") is expected


def test_innovations_smaller_than_predicted_are_no_fault() -> None:
    health, small = Health(parameters()), [Innovation("radius", [0.001], [1.0], 1e-6)]
    for tick in range(2000):
        feed(health, tick, estimate={"innovations": small if tick % 10 == 0 else [], "nis": 1e-6})
    assert level(health, "innovation_consistency") is Level.OK


class Raising(Monitor):
    """A plug-in's monitor that is wrong."""

    name = "raising"
    title = "toy"
    test = "none"

    def feed(self, observation: Observation) -> None:
        raise ZeroDivisionError("division by zero")


def test_a_monitor_that_raises_has_failed_and_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(MONITORS, "raising", Raising)
    health = Health(parameters())
    for tick in range(30):
        feed(health, tick, measurement={"mass": 100.0 if tick < 15 else 50.0})
    assert failed(health) == {"raising", "mass"}
    assert "raising: ZeroDivisionError: division by zero" in map(str, health.notable)


def test_a_monitor_that_cannot_be_prepared_is_a_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    def prepare(_: Monitor) -> None:
        raise KeyError("threshold")

    monkeypatch.setattr(Raising, "prepare", prepare)
    monkeypatch.setitem(MONITORS, "raising", Raising)
    with pytest.raises(ConfigurationError, match="monitor raising: cannot be prepared: KeyError: 'threshold'"):
        Health(parameters())


def test_an_estimate_that_repeats_exactly_is_frozen() -> None:
    health, state = Health(parameters()), np.array([0.0, -100.0, 0.0, 0.0, 0.0, 1e-9])
    for tick in range(100):
        feed(health, tick, estimate={"relative_state": state + 1e-12 * tick})
    assert level(health, "frozen_estimate") is Level.OK
    for tick in range(100, 131):
        feed(health, tick, estimate={"relative_state": state})
    assert level(health, "frozen_estimate") is Level.FAILED
