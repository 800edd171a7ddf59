"""Faults of the avionics: what measurements tell besides readings, against the truth."""

import numpy as np
import pytest

from formation_gnc.orbit.frames import hill_rotation, relative_from_inertial
from formation_gnc.plant.faults.avionics import AvionicsFault
from formation_gnc.plant.faults.registry import FAULTS

from .conftest import COMMAND, Flight, Fly

BEGIN, END = 10, 21
WHEN = f"at: {BEGIN}.0, until: {END}.0, deputy: deputy1"
FIELDS = {
    "mass_scale": "factor: 10.0",
    "force_freeze": "",
    "force_zero": "",
    "chief_freeze": "",
    "chief_drift": "rate: [0.0, 0.5, 0.0]",
    "chief_jump": "offset: [0.0, 30.0, -40.0]",
}
"""Of one entry of each fault of the avionics."""
TOLD = {"mass_scale": "mass", "force_freeze": "applied_force", "force_zero": "applied_force"}
ROUNDING = 1e-8  # m; ten units in the last place of an orbit's radius
RATE_ROUNDING = 1e-11  # m/s; the same of an orbital speed


def entry(name: str) -> str:
    return f"{{{WHEN}, fault: {name}{', ' if FIELDS[name] else ''}{FIELDS[name]}}}"


def push(tick: int) -> np.ndarray:
    """A command that differs from tick to tick."""
    return COMMAND * (1.0 + 0.1 * tick)


def offsets(flight: Flight) -> np.ndarray:
    """State of the chief as told relative to the true one, (N, 6), Hill frame."""
    pairs = zip(flight.chief, flight.told("chief_state"), strict=True)
    return np.array([relative_from_inertial(true, told) for true, told in pairs])


def test_every_fault_of_the_avionics_has_an_example() -> None:
    assert FIELDS.keys() == {name for name, fault in FAULTS.items() if issubclass(fault, AvionicsFault)}


@pytest.mark.parametrize("name", FIELDS)
def test_a_fault_changes_nothing_but_what_it_is_about(name: str, fly: Fly) -> None:
    clean, faulty = fly(command=push), fly(entry(name), command=push)
    about = TOLD.get(name, "chief_state")
    for deputy in ("deputy1", "deputy2"):
        for tick, (one, other) in enumerate(zip(faulty.measurements[deputy], clean.measurements[deputy], strict=True)):
            holds = deputy == "deputy1" and BEGIN <= tick < END
            for field in ("readings", "mass", "applied_force", "chief_state", "eclipse", "fix"):
                same = repr(getattr(one, field)) == repr(getattr(other, field))
                assert same == (not holds or field != about) or (field == "chief_state" and tick == BEGIN)
        assert repr(faulty.truths[deputy]) == repr(clean.truths[deputy])


@pytest.mark.parametrize("factor", ["10.0", "0.01"])
def test_mass_is_told_as_a_multiple(factor: str, fly: Fly) -> None:
    masses = fly(f"{{{WHEN}, fault: mass_scale, factor: {factor}}}").told("mass")
    assert masses[BEGIN:END] == [float(factor) * 100.0] * (END - BEGIN)
    assert masses[:BEGIN] + masses[END:] == [100.0] * (BEGIN + 30 - END)


def test_the_force_told_is_frozen(fly: Fly) -> None:
    faulty = fly(entry("force_freeze"), command=push)
    told, true = np.array(faulty.told("applied_force")), np.array(faulty.true("applied_force"))
    assert told[BEGIN:END].tolist() == [true[BEGIN - 1].tolist()] * (END - BEGIN)
    assert told[:BEGIN].tolist() + told[END:].tolist() == true[:BEGIN].tolist() + true[END:].tolist()


def test_the_force_told_is_zero(fly: Fly) -> None:
    told = np.array(fly(entry("force_zero")).told("applied_force"))
    assert not told[BEGIN:END].any()
    assert (told[END:] == COMMAND).all()


def test_the_ephemeris_is_frozen(fly: Fly) -> None:
    faulty = fly(entry("chief_freeze"))
    told = [each.tolist() for each in faulty.told("chief_state")]
    true = [each.tolist() for each in faulty.chief]
    assert told == true[:BEGIN] + [true[BEGIN - 1]] * (END - BEGIN) + true[END:]


def test_the_ephemeris_drifts_along_the_hill_axes(fly: Fly) -> None:
    found = offsets(fly(entry("chief_drift")))
    for tick in range(BEGIN, END):
        assert found[tick, :3] == pytest.approx([0.0, 0.5 * (tick - BEGIN), 0.0], abs=ROUNDING)
        assert found[tick, 3:] == pytest.approx([0.0, 0.5, 0.0], abs=RATE_ROUNDING)
    assert not np.delete(found, range(BEGIN, END), axis=0).any()


def test_the_ephemeris_jumps_and_stays_off(fly: Fly) -> None:
    flight = fly(entry("chief_jump"))
    found = offsets(flight)
    assert found[BEGIN:END, :3] == pytest.approx(np.tile([0.0, 30.0, -40.0], (END - BEGIN, 1)), abs=ROUNDING)
    assert found[BEGIN:END, 3:] == pytest.approx(0.0, abs=RATE_ROUNDING)
    separation = flight.told("chief_state")[BEGIN][:3] - flight.chief[BEGIN][:3]
    assert hill_rotation(flight.chief[BEGIN]) @ separation == pytest.approx([0.0, 30.0, -40.0], abs=ROUNDING)
    assert not np.delete(found, range(BEGIN, END), axis=0).any()


def test_an_untold_thruster_fault_is_frozen_as_it_was_told(fly: Fly) -> None:
    stuck = "{at: 5.0, deputy: deputy1, fault: stuck_on, told: false, force: [0.01, 0.01, 0.01]}"
    faulty = fly(stuck, entry("force_freeze"), command=push)
    assert faulty.told("applied_force")[END - 1].tolist() == push(BEGIN - 2).tolist()  # over the tick before


def test_the_same_fault_twice_on_the_ephemeris_adds_up(fly: Fly) -> None:
    found = offsets(fly(entry("chief_jump"), entry("chief_jump")))
    # The second frame is that of the first point, 50 m on: 50 m / 7e6 m of 50 m
    assert found[BEGIN, :3] == pytest.approx([0.0, 60.0, -80.0], abs=4e-4)
