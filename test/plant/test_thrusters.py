"""Thrusters: limits, thresholds, impulse, propellant, failures."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.errors import ParameterError
from formation_gnc.parameters import load
from formation_gnc.plant.thrusters import STANDARD_GRAVITY, Denial, Thruster, ThrusterParameters

COMMAND = st.tuples(*[st.floats(-0.1, 0.1)] * 3).map(np.array)
WIDE = ThrusterParameters(limit=(1.0, 1.0, 1.0))


def thruster(tick=1.0, seed=1, **changes):
    return Thruster(replace(WIDE, **changes), tick, np.random.default_rng(seed))


def fire(thruster, command, eclipse=False, mass=100.0):
    force, state, reasons = thruster.apply(list(command), eclipse, thruster.start(mass))
    return np.array(force), state, reasons


@given(COMMAND)
def test_ideal_thruster_applies_the_command(command):
    force, state, reasons = fire(thruster(), command)
    assert np.array_equal(force, command)
    assert (state.mass, reasons) == (100.0, ())


@given(COMMAND)
def test_each_axis_has_its_own_limit_and_reports_it(command):
    limit = np.array([0.01, 0.02, 0.03])
    force, _, reasons = fire(thruster(limit=tuple(limit)), command)
    assert np.array_equal(force, np.clip(command, -limit, limit))
    assert (Denial.LIMIT in reasons) == bool(np.any(np.abs(command) > limit))


@given(COMMAND)
def test_total_limit_scales_the_force_in_its_direction(command):
    force, _, _ = fire(thruster(total_limit=0.02), command)
    assert np.linalg.norm(force) <= 0.02 * (1 + 1e-15)
    assert np.cross(force, command) == pytest.approx(0.0, abs=1e-17)
    assert force @ command >= 0.0


def test_commands_below_dead_band_or_impulse_bit_do_not_fire():
    force, _, reasons = fire(thruster(dead_band=1e-3), [0.9e-3, -1.1e-3, 0.0])
    assert force == pytest.approx([0.0, -1.1e-3, 0.0])
    assert reasons == (Denial.TOO_SMALL,)
    # What is rounded below the impulse bit does not fire either.
    force, _, reasons = fire(thruster(quantum=0.7e-3, minimum_impulse=1e-3), [1.0e-3, 1.1e-3, 0.0])
    assert force == pytest.approx([0.0, 1.4e-3, 0.0])
    assert reasons == (Denial.TOO_SMALL,)
    # 1 mN s over 10 s is 0.1 mN.
    force, _, reasons = fire(thruster(tick=10.0, minimum_impulse=1e-3), [0.9e-4, -1.1e-4, 0.0])
    assert force == pytest.approx([0.0, -1.1e-4, 0.0])
    assert reasons == (Denial.TOO_SMALL,)


@given(COMMAND)
def test_quantised_force_is_the_nearest_step_within_the_limit(command):
    force, _, _ = fire(thruster(quantum=3e-3, limit=(0.01, 0.01, 0.01)), command)
    assert force / 3e-3 == pytest.approx(np.round(force / 3e-3), abs=1e-9)
    assert np.all(np.abs(force) <= 0.01)
    inside = np.abs(command) <= 9e-3
    assert np.all(np.abs(force - command)[inside] <= 1.5e-3 * (1 + 1e-9))


def test_lag_approaches_the_command_exponentially_with_exact_impulse():
    slow, fine = thruster(tick=2.0, lag=3.0), thruster(tick=0.5, lag=3.0)
    state, impulse = slow.start(100.0), []
    for k in range(4):
        force, state, _ = slow.apply([0.6, 0.0, 0.0], False, state)
        impulse.append(2.0 * force[0])
        assert state.output[0] == pytest.approx(0.6 * (1 - np.exp(-2.0 * (k + 1) / 3.0)))
    state, finely = fine.start(100.0), 0.0
    for _ in range(16):
        force, state, _ = fine.apply([0.6, 0.0, 0.0], False, state)
        finely += 0.5 * force[0]
    assert sum(impulse) == pytest.approx(finely)
    assert sum(impulse) == pytest.approx(0.6 * (8.0 - 3.0 * (1 - np.exp(-8.0 / 3.0))))


def test_misalignment_rotates_the_force_by_a_fixed_angle():
    one = thruster(misalignment=0.02)
    first, state, _ = fire(one, [0.01, 0.0, 0.0])
    second, _, _ = one.apply([0.02, 0.0, 0.0], False, state)
    assert np.linalg.norm(first) == pytest.approx(0.01)
    assert second == pytest.approx(2 * first)
    assert 0.0 < np.arccos(first[0] / 0.01) < 0.1
    assert not np.allclose(first, fire(thruster(misalignment=0.02, seed=2), [0.01, 0.0, 0.0])[0])


def test_misalignment_has_its_standard_deviation():
    """A force along x has a y component by the rotation about z."""
    turns = [fire(thruster(misalignment=0.01, seed=k), [1.0, 0.0, 0.0])[0][1] for k in range(2000)]
    assert np.std(turns) == pytest.approx(0.01, rel=0.05)  # 3 sigma of 2,000 samples


def test_noise_is_proportional_to_the_force():
    one = thruster(magnitude_noise=0.05)
    state, forces = one.start(100.0), []
    for _ in range(4000):
        force, state, _ = one.apply([0.01, 0.0, -0.02], False, state)
        forces.append(force)
    forces = np.array(forces)
    assert np.mean(forces, axis=0) == pytest.approx([0.01, 0.0, -0.02], rel=0.004)
    assert np.std(forces[:, 0]) == pytest.approx(0.0005, rel=0.04)
    assert np.all(forces[:, 1] == 0.0)


def test_noise_does_not_depend_on_whether_thrust_was_denied():
    one, other = thruster(magnitude_noise=0.1, off_in_eclipse=True), thruster(magnitude_noise=0.1)
    _, state, _ = fire(one, [0.01, 0.0, 0.0], eclipse=True)
    fire(other, [0.01, 0.0, 0.0])
    command = [0.01, 0.02, 0.03]
    assert np.array_equal(one.apply(command, False, state)[0], other.apply(command, False, state)[0])


@pytest.mark.covers("Neokleous (2.28)", "plant/thrusters.py")
def test_propellant_follows_the_rocket_equation():
    one = thruster(specific_impulse=200.0, dry_mass=50.0)
    state, speed = one.start(100.0), 0.0
    for _ in range(20_000):
        force, after, _ = one.apply([1.0, 0.0, 0.0], False, state)
        speed += force[0] / state.mass
        state = after
    # The mass is held over a tick: 5 mg/s of 100 kg, 5e-6 relative.
    assert speed == pytest.approx(200.0 * STANDARD_GRAVITY * np.log(100.0 / state.mass), rel=1e-5)


def test_propellant_flow_is_by_axis_or_of_one_gimballed_thruster():
    _, by_axis, _ = fire(thruster(specific_impulse=200.0), [0.03, 0.04, 0.0])
    _, gimballed, _ = fire(thruster(specific_impulse=200.0, total_limit=1.0), [0.03, 0.04, 0.0])
    assert 100.0 - by_axis.mass == pytest.approx(0.07 / (200.0 * STANDARD_GRAVITY))
    assert 100.0 - gimballed.mass == pytest.approx(0.05 / (200.0 * STANDARD_GRAVITY))


def test_tank_gives_its_last_propellant_and_reports_empty():
    one = thruster(specific_impulse=200.0, dry_mass=50.0)
    drop = 0.25 * 1.0 / (200.0 * STANDARD_GRAVITY)
    force, state, reasons = fire(one, [1.0, 0.0, 0.0], mass=50.0 + drop)
    assert force[0] == pytest.approx(0.25)
    assert (state.mass, reasons) == (50.0, (Denial.EMPTY,))
    force, state, reasons = one.apply([1.0, 0.0, 0.0], False, state)
    assert np.array_equal(force, np.zeros(3))
    assert (state.mass, reasons) == (50.0, (Denial.EMPTY,))
    assert one.apply([0.0, 0.0, 0.0], False, state)[2] == ()  # no command, nothing denied


def test_eclipse_cuts_thrust_only_if_configured():
    force, state, reasons = fire(thruster(off_in_eclipse=True, lag=5.0), [0.01, 0.0, 0.0], eclipse=True)
    assert np.array_equal(force, np.zeros(3))
    assert (state.output, reasons) == ((0.0, 0.0, 0.0), (Denial.ECLIPSE,))
    assert fire(thruster(), [0.01, 0.0, 0.0], eclipse=True)[0][0] == 0.01


def test_failed_axis_has_no_force_and_may_fail_in_flight():
    one = thruster()
    _, state, reasons = fire(one, [0.01, 0.02, 0.03])
    assert reasons == ()
    one.parameters = replace(one.parameters, failed=(False, True, False))
    force, _, reasons = one.apply([0.01, 0.02, 0.03], False, state)
    assert force == pytest.approx([0.01, 0.0, 0.03])
    assert reasons == (Denial.FAILED,)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_non_finite_command_gives_no_thrust(bad):
    force, state, reasons = fire(thruster(), [bad, 0.01, 0.0])
    assert np.array_equal(force, np.zeros(3))
    assert (state.mass, reasons) == (100.0, (Denial.NOT_FINITE,))


@given(
    COMMAND,
    st.booleans(),
    st.floats(0.0, 0.1),
    st.floats(1e-6, 0.02),
    st.floats(0.0, 20.0),
    st.floats(50.0, 50.0001),
)
def test_force_and_mass_are_within_bounds_in_any_configuration(command, eclipse, total, quantum, lag, mass):
    one = thruster(
        limit=(0.02, 0.02, 0.02),
        total_limit=total,
        quantum=quantum,
        lag=lag,
        specific_impulse=100.0,
        dry_mass=50.0,
        off_in_eclipse=True,
    )
    force, state, _ = fire(one, command, eclipse, mass)
    assert np.isfinite(force).all()
    assert np.all(np.abs(force) <= 0.02 * (1 + 1e-12))
    assert 50.0 <= state.mass <= mass


def test_invalid_masses_and_parameters_are_rejected():
    with pytest.raises(ParameterError, match=r"mass: -1\.0 kg"):
        thruster().start(-1.0)
    with pytest.raises(ParameterError, match=r"at least the dry mass, 50\.0 kg"):
        thruster(dry_mass=50.0).start(40.0)
    with pytest.raises(ParameterError, match="quantum"):
        thruster(quantum=2.0)
    with pytest.raises(ParameterError, match=r"parameter limit: .* at least 0"):
        load(ThrusterParameters, {"limit": [-1.0, 0.0, 0.0]})
    with pytest.raises(ParameterError, match="3 values"):
        load(ThrusterParameters, {"limit": [1.0]})
