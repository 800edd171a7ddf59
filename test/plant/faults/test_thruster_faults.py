"""Faults of thrusters: force and propellant of the truth, and what measurements tell of them."""

import math

import numpy as np
import pytest

from formation_gnc.orbit.frames import hill_rotation
from formation_gnc.plant.faults.registry import FAULTS
from formation_gnc.plant.faults.thrusters import ThrusterFault
from formation_gnc.plant.thrusters import STANDARD_GRAVITY
from formation_gnc.records import EventKind

from .conftest import COMMAND, Fly

BEGIN, END, TICKS = 10, 21, 30
WHEN = f"at: {BEGIN}.0, until: {END}.0, deputy: deputy1"
FIELDS = {
    "stuck_on": "force: [0.01, 0.0, 0.0], axes: [true, false, false]",
    "stuck_off": "axes: [false, true, false]",
    "thrust_scale": "factor: [0.5, 1.0, -1.0]",
    "misalignment": "rotation: [0.0, 0.0, 0.1]",
    "leak": "force: [0.0, 0.0005, 0.0]",
    "slow": "lag: 4.0",
}
"""Of one entry of each fault of thrusters."""

X, Y, Z = COMMAND
COS, SIN = math.cos(0.1), math.sin(0.1)
FORCES = {
    "stuck_on": [0.01, Y, Z],
    "stuck_off": [X, 0.0, Z],
    "thrust_scale": [0.5 * X, Y, -Z],
    "misalignment": [COS * X - SIN * Y, SIN * X + COS * Y, Z],
    "leak": [X, Y + 0.0005, Z],
}
"""Forces (N) with the fault at the command, but for the one that depends on the past."""

TANK = {"deputy1.thrusters.specific_impulse": 200.0, "deputy1.thrusters.dry_mass": 90.0}


def entry(name: str, told: str = "true", when: str = WHEN) -> str:
    return f"{{{when}, fault: {name}, told: {told}, {FIELDS[name]}}}"


def test_every_fault_of_thrusters_has_an_example() -> None:
    assert FIELDS.keys() == {name for name, fault in FAULTS.items() if issubclass(fault, ThrusterFault)}


@pytest.mark.parametrize("name", FORCES)
def test_the_force_is_that_of_the_fault_while_it_lasts(name: str, fly: Fly) -> None:
    force = np.array(fly(entry(name)).true("applied_force"))  # of the tick before
    assert force[0].tolist() == [0.0, 0.0, 0.0]
    for tick in range(TICKS - 1):
        expected = FORCES[name] if BEGIN <= tick < END else COMMAND
        assert force[tick + 1] == pytest.approx(expected, abs=1e-17), tick  # 1e-15 of a millinewton


def test_slow_thrust_follows_with_its_lag(fly: Fly) -> None:
    def step(tick: int) -> np.ndarray:
        return COMMAND if tick < 15 else -COMMAND

    force = np.array(fly(entry("slow"), command=step).true("applied_force"))[1:]
    assert force[:15] == pytest.approx(np.tile(COMMAND, (15, 1)))  # it begins from the force that there was
    for tick in range(15, END):  # mean over the tick of the exponential
        mean = 4.0 * (math.exp(-(tick - 15) / 4.0) - math.exp(-(tick - 14) / 4.0))
        assert force[tick] == pytest.approx(-COMMAND + 2.0 * COMMAND * mean, rel=1e-12)
    assert force[END:].tolist() == [(-COMMAND).tolist()] * (TICKS - 1 - END)


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("told", ["true", "false"])
def test_measurements_tell_the_force_or_what_it_would_have_been(name: str, told: str, fly: Fly) -> None:
    clean, faulty = fly(), fly(entry(name, told))
    expected = faulty.true("applied_force") if told == "true" else clean.true("applied_force")
    assert [each.tobytes() for each in faulty.told("applied_force")] == [each.tobytes() for each in expected]


def test_of_two_faults_the_one_told_is_in_the_telemetry(fly: Fly) -> None:
    both = fly(entry("stuck_off", "true"), entry("stuck_on", "false"))
    assert both.true("applied_force")[BEGIN + 1] == pytest.approx([0.01, 0.0, Z])
    assert both.told("applied_force")[BEGIN + 1] == pytest.approx([X, 0.0, Z])


@pytest.mark.parametrize("name", FIELDS)
def test_impulse_equals_the_momentum_that_the_truth_gains(name: str, fly: Fly) -> None:
    clean, faulty = fly(command=np.zeros(3)), fly(entry(name))
    impulse = np.zeros(3)
    for tick, force in enumerate(faulty.true("applied_force")[1:]):
        impulse += hill_rotation(faulty.chief[tick]).T @ force * 1.0
    gained = 100.0 * (faulty.true("inertial_state")[-1][3:] - clean.true("inertial_state")[-1][3:])
    # Gravity's gradient over 29 s: (n t)^2 = 1e-3 of the impulse
    assert gained == pytest.approx(impulse, abs=1e-3 * np.linalg.norm(impulse))


@pytest.mark.parametrize("name", [each for each in FORCES if each != "misalignment"])
def test_propellant_is_used_for_the_force_that_there_is(name: str, fly: Fly) -> None:
    faulty = fly(entry(name), values=TANK)
    mass = np.array(faulty.true("mass"))
    used = np.array([np.abs(COMMAND if not BEGIN <= tick < END else FORCES[name]).sum() for tick in range(TICKS - 1)])
    if name == "leak":  # beside the thrusters, in one direction
        used[BEGIN:END] = np.abs(COMMAND).sum() + 0.0005
    # a difference of masses of 100 kg has an error of 1.4e-14 kg
    assert -np.diff(mass) == pytest.approx(used / (200.0 * STANDARD_GRAVITY), abs=3e-14)


def test_turned_thrust_uses_the_propellant_of_the_command(fly: Fly) -> None:
    assert fly(entry("misalignment"), values=TANK).true("mass") == fly(values=TANK).true("mass")


@pytest.mark.parametrize("name", ["stuck_on", "leak"])
def test_thrust_without_command_ends_with_the_propellant(name: str, fly: Fly) -> None:
    flow = (0.01 if name == "stuck_on" else 0.0005) / (200.0 * STANDARD_GRAVITY)  # kg/s
    tank = TANK | {"deputy1.thrusters.dry_mass": 100.0 - 2.5 * flow}
    faulty = fly(entry(name), command=np.zeros(3), values=tank)
    force = np.linalg.norm(faulty.true("applied_force"), axis=1)[1:] / (flow * 200.0 * STANDARD_GRAVITY)
    assert force[BEGIN : BEGIN + 4] == pytest.approx([1.0, 1.0, 0.5, 0.0], rel=1e-6)  # 1e-8 of a tick's use, of 100 kg
    assert faulty.true("mass")[-1] == tank["deputy1.thrusters.dry_mass"]
    details = [event.detail for event in faulty.events if event.kind == EventKind.THRUSTERS]
    assert details == ["empty tank", "as commanded again"]


@pytest.mark.parametrize("command", [None, np.full(3, np.nan)], ids=["miss", "nan"])
def test_a_stuck_thruster_fires_when_nothing_is_commanded(command: np.ndarray | None, fly: Fly) -> None:
    faulty = fly(entry("stuck_on"), command=lambda _: command)
    force = np.array(faulty.true("applied_force"))[1:]
    assert force[BEGIN:END].tolist() == [[0.01, 0.0, 0.0]] * (END - BEGIN)
    assert not force[:BEGIN].any()
    assert not force[END:].any()
    assert all(each.fix_available for each in faulty.measurements["deputy1"])  # the misses are misses all the same


def test_a_fault_before_it_begins_leaves_every_bit(fly: Fly) -> None:
    disturbed = {
        "deputy1.thrusters.misalignment": 0.01,
        "deputy1.thrusters.magnitude_noise": 0.1,
        "deputy1.thrusters.lag": 3.0,
        **TANK,
    }
    later = [entry(name, when="at: 5000.0, deputy: deputy1") for name in FIELDS]

    def command(tick: int) -> np.ndarray | None:
        return None if tick % 7 == 0 else COMMAND * (tick % 3 - 1)

    clean, faulty = fly(command=command, values=disturbed), fly(*later, command=command, values=disturbed)
    for one, other in zip(faulty.truths["deputy1"], clean.truths["deputy1"], strict=True):
        assert one.inertial_state.tobytes() == other.inertial_state.tobytes()
        assert one.applied_force.tobytes() == other.applied_force.tobytes()
        assert one.mass == other.mass
    for one, other in zip(faulty.told("applied_force"), clean.told("applied_force"), strict=True):
        assert one.tobytes() == other.tobytes()


def test_magnitude_noise_of_later_ticks_does_not_depend_on_a_fault(fly: Fly) -> None:
    noisy = {"deputy1.thrusters.magnitude_noise": 0.1}
    clean, faulty = fly(values=noisy), fly(entry("stuck_off"), values=noisy)
    for tick, (one, other) in enumerate(zip(faulty.true("applied_force"), clean.true("applied_force"), strict=True)):
        expected = other.copy()
        expected[1] = 0.0 if BEGIN < tick <= END else other[1]
        assert one.tolist() == expected.tolist()
