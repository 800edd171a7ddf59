"""Plant: truth against independent integration, thrust, misses and fixes, and parameters."""

import math
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.parameters import load
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.plant.plant import Plant
from formation_gnc.records import Measurement, Truth

Array = NDArray[np.float64]

AWAY = [10.0, -90.0, 10.0, 0.02, 0.0, -0.01]
VALUES = {
    "chief.semi_major_axis": 6978100.0,
    "chief.eccentricity": 0.01,
    "chief.inclination": 1.48,
    "chief.right_ascension": 0.4,
    "chief.argument_of_perigee": -1.0,
    "chief.true_anomaly": 2.0,
    "duration": 6000.0,
    "deputy1.relative_state": AWAY,
}
PUSH = {"deputy1": np.array([0.004, -0.003, 0.002])}
ROUNDING = 1e-7  # m; a few units in the last place of an orbit's radius


def plant(**values: Any) -> Plant:
    return Plant(load(PlantParameters, VALUES | {name.replace("__", "."): value for name, value in values.items()}))


def observe(simulated: Plant) -> tuple[Truth, dict[str, Measurement]]:
    measurements = simulated.measure()
    return simulated.truth(), measurements


def run(simulated: Plant, ticks: int, forces: dict[str, Array]) -> None:
    for _ in range(ticks):
        observe(simulated)
        simulated.step(forces)


def hill_axes(chief: Array) -> Array:
    """Rows x, y, z of the Hill frame in inertial components, from their definition."""
    radial = chief[:3] / np.linalg.norm(chief[:3])
    normal = np.cross(chief[:3], chief[3:])
    normal /= np.linalg.norm(normal)
    return np.array([radial, np.cross(normal, radial), normal])


def gravity(position: Array) -> Array:
    """Point mass with J2, the textbook's three components."""
    x, y, z = position
    r = math.sqrt(x * x + y * y + z * z)
    k, u = 1.5 * J2 * (EARTH_RADIUS / r) ** 2, 5.0 * (z / r) ** 2
    return -MU / r**3 * np.array([x * (1.0 + k * (1.0 - u)), y * (1.0 + k * (1.0 - u)), z * (1.0 + k * (3.0 - u))])


def integrated(state: Array, duration: float, acceleration: Array) -> Array:
    """Inertial state after a duration, by SciPy, an order of magnitude more accurate than the tolerances."""

    def rate(_: float, y: Array) -> Array:
        return np.concatenate([y[3:], gravity(y[:3]) + acceleration])

    solution = solve_ivp(rate, (0.0, duration), state, method="DOP853", rtol=1e-13, atol=1e-5)
    return np.asarray(solution.y[:, -1])


def test_deputy_starts_at_its_relative_state() -> None:
    truth, _ = observe(plant())
    assert truth.deputies[0].relative_state == pytest.approx(AWAY, abs=ROUNDING)
    separation = truth.deputies[0].inertial_state[:3] - truth.chief_state[:3]
    assert hill_axes(truth.chief_state) @ separation == pytest.approx(AWAY[:3], abs=ROUNDING)


@pytest.mark.parametrize("tick", [1.0, 60.0])
def test_orbit_is_integrated_to_better_than_a_millimetre(tick: float) -> None:
    interval = {f"deputy1__sensors__{name}__interval": 60.0 for name in ("radius", "range_rate", "latitude")}
    simulated = plant(tick=tick, **interval)
    start, _ = observe(simulated)
    orbit = 5820.0  # s; whole ticks, a little over one revolution
    run(simulated, round(orbit / tick), {"deputy1": np.zeros(3)})
    end, _ = observe(simulated)
    for before, after in (
        (start.chief_state, end.chief_state),
        (start.deputies[0].inertial_state, end.deputies[0].inertial_state),
    ):
        true = integrated(before, orbit, np.zeros(3))
        assert np.linalg.norm(after[:3] - true[:3]) < 1e-3
        assert np.linalg.norm(after[3:] - true[3:]) < 1e-6  # 1 mm times the orbital rate


def test_force_acts_along_the_hill_axes_at_the_start_of_its_tick() -> None:
    simulated, free = plant(tick=10.0), plant(tick=10.0)
    run(simulated, 3, {})
    run(free, 3, {})
    truth, _ = observe(simulated)
    simulated.step(PUSH)
    free.step({})
    pushed, _ = observe(simulated)
    coasted, _ = observe(free)
    acceleration = PUSH["deputy1"] / 100.0 @ hill_axes(truth.chief_state)
    true = integrated(truth.deputies[0].inertial_state, 10.0, acceleration)
    assert pushed.deputies[0].inertial_state == pytest.approx(true, abs=ROUNDING)
    assert np.array_equal(pushed.chief_state, coasted.chief_state)
    gained = pushed.deputies[0].inertial_state[3:] - coasted.deputies[0].inertial_state[3:]
    impulse = 10.0 * acceleration
    assert gained == pytest.approx(impulse, abs=2e-4 * np.linalg.norm(impulse))  # gravity's gradient: (n t)^2


def test_truth_and_measurement_report_the_force_of_the_previous_tick() -> None:
    simulated = plant()
    truth, measurements = observe(simulated)
    assert not truth.deputies[0].applied_force.any()
    assert not measurements["deputy1"].applied_force.any()
    simulated.step(PUSH)
    truth, measurements = observe(simulated)
    assert truth.deputies[0].applied_force.tolist() == PUSH["deputy1"].tolist()
    assert measurements["deputy1"].applied_force.tolist() == PUSH["deputy1"].tolist()


def test_force_is_limited_on_each_axis() -> None:
    cut, within = plant(deputy1__thrusters__limit=[0.01, 0.0, 0.02]), plant()
    cut.step({"deputy1": np.array([-5.0, 0.003, 0.002])})
    within.step({"deputy1": np.array([-0.01, 0.0, 0.002])})
    one, other = observe(cut)[0].deputies[0], observe(within)[0].deputies[0]
    assert one.applied_force.tolist() == [-0.01, 0.0, 0.002]
    assert np.array_equal(one.inertial_state, other.inertial_state)


def test_acceleration_is_force_over_mass() -> None:
    light, heavy = plant(deputy1__mass=50.0), plant(deputy1__mass=200.0)
    run(light, 20, {"deputy1": np.zeros(3)})
    run(heavy, 20, {"deputy1": np.zeros(3)})
    assert np.array_equal(observe(light)[0].deputies[0].inertial_state, observe(heavy)[0].deputies[0].inertial_state)
    light.step({"deputy1": np.array([0.001, 0.0, 0.0])})
    heavy.step({"deputy1": np.array([0.004, 0.0, 0.0])})
    assert np.array_equal(observe(light)[0].deputies[0].inertial_state, observe(heavy)[0].deputies[0].inertial_state)


@pytest.mark.parametrize(
    "forces",
    [
        {},
        {"deputy1": np.array([np.nan, 0.0, 0.0])},
        {"deputy1": np.array([0.0, np.inf, 0.0])},
        {"deputy1": np.array([0.001, 0.001, -np.inf])},
        {"somebody": np.zeros(3)},
    ],
)
def test_deputy_without_a_finite_command_coasts_and_gets_a_fix(
    forces: dict[str, Array],
) -> None:
    missed, coasting = plant(), plant()
    run(missed, 5, PUSH)
    run(coasting, 5, PUSH)
    assert missed.step(forces) == ["deputy1"]
    assert coasting.step({"deputy1": np.zeros(3)}) == []
    truth, measurements = observe(missed)
    expected, without = observe(coasting)
    assert np.array_equal(truth.deputies[0].inertial_state, expected.deputies[0].inertial_state)
    assert not truth.deputies[0].applied_force.any()
    measurement = measurements["deputy1"]
    assert measurement.fix_available
    # Normal errors of 0.5 m and 0.5 mm/s are within six sigma.
    error = (measurement.fix - truth.deputies[0].relative_state) / np.repeat([0.5, 0.0005], 3)
    assert 0.0 < np.abs(error).max() < 6.0
    assert not without["deputy1"].fix_available
    assert not without["deputy1"].fix.any()
    assert missed.step(PUSH) == []
    assert not observe(missed)[1]["deputy1"].fix_available


def test_first_measurement_has_a_fix() -> None:
    simulated = plant()
    assert observe(simulated)[1]["deputy1"].fix_available
    simulated.step(PUSH)
    assert not observe(simulated)[1]["deputy1"].fix_available


def test_deputies_and_their_misses_are_independent() -> None:
    other = {"deputies": ["deputy1", "deputy2"], "deputy2__relative_state": [0.0, 50.0, 0.0, 0.0, 0.0, 0.0]}
    alone, together = plant(), plant(**other)
    for tick in range(30):
        one, measured_alone = observe(alone)
        two, measured_together = observe(together)
        assert np.array_equal(one.deputies[0].inertial_state, two.deputies[0].inertial_state)
        mine, theirs = measured_alone["deputy1"], measured_together["deputy1"]
        assert mine.readings == theirs.readings
        assert mine.fix.tolist() == theirs.fix.tolist()
        alone.step(PUSH)
        missed = together.step(PUSH if tick % 3 == 0 else PUSH | {"deputy2": np.zeros(3)})
        assert missed == (["deputy2"] if tick % 3 == 0 else [])


def test_noise_of_later_readings_does_not_depend_on_a_miss() -> None:
    kept, lost = plant(tick=10.0), plant(tick=10.0)
    noise: dict[str, list[float]] = {"kept": [], "lost": []}
    for tick in range(20):
        for name, simulated in (("kept", kept), ("lost", lost)):
            truth, measurements = observe(simulated)
            radius = float(np.linalg.norm(truth.deputies[0].inertial_state[:3]))
            noise[name].append(measurements["deputy1"].readings[0].values[0] - radius)
        kept.step({"deputy1": np.zeros(3)})
        lost.step({"deputy1": np.zeros(3)} if tick % 2 else {})
    assert noise["kept"] == pytest.approx(noise["lost"], abs=ROUNDING)


def test_seed_determines_the_noise_to_the_bit_and_nothing_else() -> None:
    first, again, other = plant(seed=3), plant(seed=3), plant(seed=4)
    for _ in range(25):
        (truth, measured), (same, measured_again), (same_too, measured_otherwise) = (
            observe(simulated) for simulated in (first, again, other)
        )
        assert np.array_equal(truth.deputies[0].inertial_state, same.deputies[0].inertial_state)
        assert np.array_equal(truth.deputies[0].inertial_state, same_too.deputies[0].inertial_state)
        assert measured["deputy1"].readings == measured_again["deputy1"].readings
        if measured["deputy1"].readings:
            assert measured["deputy1"].readings != measured_otherwise["deputy1"].readings
        for simulated in (first, again, other):
            simulated.step(PUSH)


def test_records_do_not_change_after_they_are_returned() -> None:
    simulated = plant()
    observed = observe(simulated)
    kept = deepcopy(observed)
    run(simulated, 12, PUSH)
    assert repr(observed) == repr(kept)


@given(ns=st.integers(1, 10**12), tick_ns=st.integers(1, 10**11))
def test_ticks_are_those_that_begin_within_the_duration(ns: int, tick_ns: int) -> None:
    values = VALUES | {"tick": tick_ns * 1e-9, "duration": ns * 1e-9}
    if ns < tick_ns:
        with pytest.raises(ConfigurationError, match="it must be a tick or more"):
            load(PlantParameters, values)
    else:
        ticks = load(PlantParameters, values).ticks
        assert (ticks - 1) * tick_ns < ns <= ticks * tick_ns


def test_run_ends_after_the_last_tick_that_begins_in_the_duration() -> None:
    simulated = plant(tick=2.0, duration=5.0)
    stamps = []
    while not simulated.finished:
        stamps.append(observe(simulated)[0].time)
        simulated.step({})
    assert stamps == [0, 2_000_000_000, 4_000_000_000]


def rejection(values: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationError) as raised:
        Plant(load(PlantParameters, values))
    return str(raised.value)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("duration", 0.3, "parameter duration: 0.3 s is not allowed; it must be a tick or more"),
        (
            "duration",
            1e300,
            "parameter duration: 1e+300 is not allowed; it must be above 0, at most 2.14748e+09",
        ),
        ("epoch", 1e300, "parameter epoch: 1e+300 is not allowed; it must be"),
        (
            "epoch",
            1577879990.0,
            "parameter duration: 6000.0 s is not allowed; with epoch 1577879990.0 s it must end by 1577880000.0 s",
        ),
        ("tick", 1e300, "parameter tick: 1e+300 is not allowed; it must be above 0, at most 2.14748e+09"),
        ("chief.semi_major_axis", 1e300, "parameter chief.semi_major_axis: 1e+300 is not allowed"),
        ("chief.semi_major_axis", 6e6, "perigee radius is 5940000.0 m: it must be at least the Earth's"),
        ("deputy1.relative_state", [-1e6] + [0] * 5, "parameter deputy1.relative_state: [-1000000.0, 0.0"),
        (
            "deputy1.relative_state",
            [1e200] + [0] * 5,
            "parameter deputy1.relative_state: 1e+200 is not allowed",
        ),
        (
            "deputy1.sensors.range_rate.interval",
            1.5,
            "parameter deputy1.sensors.range_rate.interval: 1.5 s is not allowed; "
            "it must be a whole number of ticks of 1 s",
        ),
    ],
)
def test_parameters_that_cannot_be_flown_are_rejected_by_name(name: str, value: Any, words: str) -> None:
    assert rejection(VALUES | {name: value}).startswith(words)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ([], "[] is not allowed; it must be one or more different names"),
        (["a", "a"], "['a', 'a'] is not allowed; it must be one or more different names"),
        (["a b"], "'a b' is not allowed; a name has letters, digits and _ only"),
        (["1st"], "'1st' is not allowed; a name has letters, digits and _ only"),
        (["é"], "'é' is not allowed; a name has letters, digits and _ only"),
    ],
)
def test_names_of_deputies_must_differ_and_be_namespaces(names: list[str], words: str) -> None:
    values = {name: value for name, value in VALUES.items() if not name.startswith("deputy1")}
    states = {f"{name}.relative_state": AWAY for name in names}
    assert rejection(values | states | {"deputies": names}) == f"parameter deputies: {words}"
