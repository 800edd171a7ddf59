"""Navigation filter over whole runs: consistency, observability, and invalid input."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from formation_gnc.common import Orbit
from formation_gnc.errors import ConfigurationError
from formation_gnc.mode_records import Mode, ModeState, Restriction
from formation_gnc.navigation.kernels.motion import coast
from formation_gnc.navigation.navigation_filter import NavigationFilter
from formation_gnc.navigation.observability import (
    gramian,
    orbit_period,
    predicted_unobservable_direction,
    unobservable_directions,
)
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_transform, inertial_from_relative
from formation_gnc.parameters import load
from formation_gnc.records import Estimate, EstimateStatus, EventKind, Measurement, Rejection
from formation_gnc.sil.monte_carlo import Sample, navigation_filter, nees
from formation_gnc.sil.monte_carlo import simulate_measurements as simulate
from formation_gnc.types import NANOSECONDS, Vector

LEO = Orbit(6978100.0, inclination=radians(50.0))
GEO = Orbit(42164000.0)

THREE = ("radius", "range_rate", "latitude")


def parameters(orbit: Orbit = LEO, tick: float = 10.0, **changes: Any) -> NavigationParameters:
    return NavigationParameters(chief=orbit, tick=tick, **changes)


def run(filter: NavigationFilter, samples: Sequence[Sample]) -> list[Estimate]:
    answers = [filter.on_tick(sample.measurement) for sample in samples]
    return [answer for answer in answers if answer is not None]


def with_first(measurement: Measurement, **changes: Any) -> Measurement:
    first, *others = measurement.readings
    return replace(measurement, readings=[replace(first, **changes), *others])


def with_all(measurement: Measurement, **changes: Any) -> Measurement:
    return replace(measurement, readings=[replace(each, **changes) for each in measurement.readings])


def off_by(measurement: Measurement, error: float, place: int = 0) -> Measurement:
    """The measurement with an error on one reading."""
    readings = list(measurement.readings)
    (value,) = readings[place].values
    readings[place] = replace(readings[place], values=[value + error])
    return replace(measurement, readings=readings)


def used(estimate: Estimate) -> list[str]:
    """Sensors whose readings were used."""
    return [each.sensor for each in estimate.innovations if not each.rejection]


def rejections(estimate: Estimate) -> dict[str, int]:
    return {each.reason: each.count for each in estimate.rejections}


def turn(estimate: Estimate) -> Vector:
    """Change of the relative state per radian of a turn of the deputy's orbit about the Earth's axis."""
    x, y, _, vx, vy, _ = inertial_from_relative(estimate.chief_state, estimate.relative_state)
    return hill_transform(estimate.chief_state) @ np.array([-y, x, 0.0, -vy, vx, 0.0])


def information_on_turn(estimate: Estimate) -> float:
    return float(turn(estimate) @ np.linalg.solve(estimate.covariance, turn(estimate)))


def error_in_turn(estimate: Estimate, truth: Vector) -> float:
    """Part of the error (rad) that is a turn about the Earth's axis, by the filter's covariance."""
    weights = np.linalg.solve(estimate.covariance, turn(estimate))
    return float(weights @ (estimate.relative_state - truth)) / information_on_turn(estimate)


@pytest.mark.parametrize("filter", ["ekf", "ukf"])
@pytest.mark.parametrize("sensors", [THREE, (*THREE, "right_ascension"), (*THREE, "chief_range")])
@pytest.mark.thorough
def test_nees_and_nis_are_those_of_a_consistent_filter(filter: str, sensors: tuple[str, ...]) -> None:
    runs, ticks = (40, 60) if filter == "ekf" else (10, 40)
    setup = parameters(LEO, tick=60.0, sensors=sensors, filter=filter, acceleration_density=1e-10)
    errors, innovations, used = [], 0.0, 0
    for seed in range(runs):
        rng = np.random.default_rng([seed, len(sensors)])
        samples = list(simulate(setup, ticks, rng))
        estimates = run(navigation_filter(setup), samples)
        errors.append(nees(estimates[-1], samples[-1].truth))
        innovations += sum(each.nis for each in estimates)
        used += sum(len(each.innovations) for each in estimates)
    # Two-sided bounds that a consistent filter leaves with probability 2e-4, of fixed seeds.
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 6 * runs) / runs
    assert low < np.mean(errors) < high
    low, high = chi2.ppf([1e-4, 1 - 1e-4], used) / used
    assert low < innovations / used < high


@pytest.mark.parametrize("filter", ["ekf", "ukf"])
@pytest.mark.parametrize("orbit", [LEO, GEO, Orbit(7000000.0, 0.01, radians(98.0), 1.0, 2.0, 3.0)])
def test_a_turn_about_the_earths_axis_stays_unobserved(orbit: Orbit, filter: str) -> None:
    """Neither the information on the unobservable direction nor the error along it changes, at any inclination."""
    tick = 10.0 if orbit is not GEO else 120.0
    setup = parameters(orbit, tick=tick, acceleration_density=0.0, filter=filter)
    samples = list(simulate(setup, 600 if filter == "ekf" else 120, np.random.default_rng(1)))
    estimates = run(navigation_filter(setup), samples)
    # Linearised at an estimate metres off, the readings seem to tell a little: 1e-3 is nothing over an orbit.
    assert information_on_turn(estimates[-1]) == pytest.approx(information_on_turn(estimates[0]), rel=1e-3)
    first, last = (error_in_turn(estimates[i], samples[i].truth) for i in (0, -1))
    sigma = information_on_turn(estimates[0]) ** -0.5
    assert last == pytest.approx(first, abs=0.03 * sigma)


def test_covariance_stays_large_in_the_unobservable_direction_only() -> None:
    setup = parameters(GEO, tick=120.0, fix_position_sigma=100.0, fix_velocity_sigma=0.01, acceleration_density=0.0)
    estimates = run(navigation_filter(setup), list(simulate(setup, 1440, np.random.default_rng(2))))
    sigma = np.sqrt(np.diag(estimates[-1].covariance))
    # Along-track about an equatorial chief: as uncertain as at the start, the others at the metre and below.
    assert sigma[1] == pytest.approx(100.0, rel=0.02)
    assert sigma[0] < 1.0
    assert sigma[2] < 5.0


@given(
    st.floats(6.8e6, 4.5e7),
    st.floats(0.0, 0.1),
    st.floats(0.0, 3.0),
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
)
@settings(max_examples=20)
@pytest.mark.thorough
def test_the_gramian_finds_the_predicted_direction_at_any_inclination(
    axis: float, eccentricity: float, inclination: float, perigee: float, anomaly: float
) -> None:
    chief = state_from_elements(Elements(axis / (1 - eccentricity), eccentricity, inclination, 0.4, perigee, anomaly))
    period = orbit_period(chief)
    three = {"radius": (25.0,), "range_rate": (1e-4,), "latitude": (1e-12,)}
    unobservable = unobservable_directions(gramian(chief, three, period), 2 * np.pi / period)
    assert len(unobservable) == 1
    # Unit vectors: 1e-4 of disagreement is 1e-8 in the product.
    assert abs(unobservable[0] @ predicted_unobservable_direction(chief)) == pytest.approx(1.0, abs=1e-8)
    four = three | {"right_ascension": (1e-12,)}
    assert not len(unobservable_directions(gramian(chief, four, period), 2 * np.pi / period))


def test_the_predicted_direction_is_that_of_the_seed_cases() -> None:
    """[0, cos i, -sin i cos u, 0, 0, n sin i sin u], for a circular chief."""
    inclination, u = 0.9, 0.7
    chief = state_from_elements(Elements(7e6, 0.0, inclination, 0.3, 0.0, u))
    expected = np.array([0.0, cos(inclination), -sin(inclination) * cos(u), 0.0, 0.0, sin(inclination) * sin(u)])
    np.testing.assert_allclose(predicted_unobservable_direction(chief), expected / np.linalg.norm(expected), atol=1e-9)


@pytest.mark.thorough
def test_the_estimate_names_the_unobservable_direction_and_follows_it() -> None:
    setup = parameters(LEO, tick=10.0)
    filter = navigation_filter(setup)
    for sample in simulate(setup, 1200, np.random.default_rng(3)):  # two orbits: live windows end on the way
        estimate = filter.on_tick(sample.measurement)
        assert estimate is not None
        assert estimate.unobservable in ("along-track", "cross-track", "cross-track rate")
        predicted = predicted_unobservable_direction(sample.measurement.chief_state)
        # 100 m from the chief, rates divided by a mean motion that J2 shifts by a part in a thousand
        assert abs(estimate.unobservable_direction @ predicted) == pytest.approx(1.0, abs=1e-5)
    assert any(event.kind == EventKind.OBSERVABILITY for event in filter.take_events())


def test_a_fourth_measurement_makes_everything_observable() -> None:
    setup = parameters(GEO, tick=120.0, sensors=(*THREE, "right_ascension"), fix_position_sigma=100.0)
    samples = list(simulate(setup, 720, np.random.default_rng(4)))
    estimates = run(navigation_filter(setup), samples)
    assert estimates[-1].unobservable == ""
    assert not estimates[-1].unobservable_direction.any()
    assert np.sqrt(np.diag(estimates[-1].covariance))[:3].max() < 10.0
    assert nees(estimates[-1], samples[-1].truth) < chi2.isf(1e-4, 6)


def test_pseudo_measurements_say_the_same_to_first_order() -> None:
    samples = list(simulate(parameters(tick=60.0), 100, np.random.default_rng(5)))
    plain, pseudo = (
        run(navigation_filter(parameters(tick=60.0, pseudo_measurements=flag)), samples)[-1] for flag in (False, True)
    )
    sigma = np.sqrt(np.diag(plain.covariance))
    assert (np.abs(plain.relative_state - pseudo.relative_state) < 0.05 * sigma).all()
    np.testing.assert_allclose(np.diag(pseudo.covariance), np.diag(plain.covariance), rtol=1e-3)
    assert (plain.relative_state != pseudo.relative_state).any()


@pytest.mark.parametrize("model", ["hill", "schweighart_sedwick"])
def test_linear_process_models_are_consistent_with_more_process_noise(model: str) -> None:
    setup = parameters(tick=10.0, process_model=model, acceleration_density=1e-9)
    samples = list(simulate(parameters(tick=10.0), 580, np.random.default_rng(6)))
    estimates = run(navigation_filter(setup), samples)
    error = estimates[-1].relative_state - samples[-1].truth
    sigma = np.sqrt(np.diag(estimates[-1].covariance))
    assert (np.abs(error) < 4.0 * sigma).all()
    assert np.linalg.norm(error[:3]) < 20.0


def test_a_swap_of_filters_in_flight_hands_over_state_and_covariance() -> None:
    setup = parameters(tick=60.0, schedule=("{at: 1200.0, filter: ukf}", "{at: 2400.0, filter: ekf}"))
    samples = list(simulate(parameters(tick=60.0), 60, np.random.default_rng(7)))
    swapped, plain = run(navigation_filter(setup), samples), run(navigation_filter(parameters(tick=60.0)), samples)
    for one, other in zip(swapped, plain, strict=True):
        sigma = np.sqrt(np.diag(other.covariance))
        # Nearly linear at 100 m: the two filters differ by parts in a thousand of a sigma.
        assert (np.abs(one.relative_state - other.relative_state) < 0.01 * sigma).all()
    assert (swapped[19].relative_state == plain[19].relative_state).all()
    assert (swapped[20].relative_state != plain[20].relative_state).any()


def test_the_same_stream_gives_the_same_bits() -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 100, np.random.default_rng(8)))
    for one, other in zip(run(navigation_filter(setup), samples), run(navigation_filter(setup), samples), strict=True):
        assert one.relative_state.tobytes() == other.relative_state.tobytes()
        assert one.covariance.tobytes() == other.covariance.tobytes()


def test_known_thrust_enters_the_prediction() -> None:
    setup, force = parameters(tick=10.0), np.array([0.01, -0.01, 0.01])
    samples = list(simulate(setup, 300, np.random.default_rng(9), force))
    assert np.linalg.norm(samples[-1].truth[:3]) > 200.0
    assert nees(run(navigation_filter(setup), samples)[-1], samples[-1].truth) < chi2.isf(1e-4, 6)


def test_late_readings_are_used_at_the_time_they_were_taken() -> None:
    """Everything 30 s late, under thrust: kilometres off if used as fresh; and little information is lost."""
    setup, force = parameters(tick=10.0, acceleration_density=1e-12), np.array([0.01, -0.01, 0.01])
    samples = list(simulate(setup, 300, np.random.default_rng(10), force))
    late = [samples[0], *samples[1:]]
    for index, sample in enumerate(samples):
        old = samples[index - 3].measurement if index >= 3 else None
        late[index] = Sample(
            sample.truth,
            replace(
                sample.measurement,
                readings=[replace(each, age=30 * NANOSECONDS) for each in old.readings] if old else [],
            ),
        )
    fresh, delayed = run(navigation_filter(setup), samples)[-1], run(navigation_filter(setup), late)[-1]
    assert not delayed.rejections
    assert nees(delayed, samples[-1].truth) < chi2.isf(1e-4, 6)
    assert (np.diag(delayed.covariance) < 1.5 * np.diag(fresh.covariance)).all()


def test_outliers_are_rejected_and_counted() -> None:
    setup, rng = parameters(tick=10.0), np.random.default_rng(11)
    samples, wrong = [], 0
    for index, sample in enumerate(simulate(setup, 600, rng)):
        measurement = sample.measurement
        if index % 20 == 10:
            wrong += 1
            place = index // 20 % 3
            measurement = off_by(measurement, [250.0, -0.5, 5e-5][place], place)  # 50 standard deviations
        samples.append(Sample(sample.truth, measurement))
    estimates = run(navigation_filter(setup), samples)
    assert rejections(estimates[-1]) == {Rejection.GATE: wrong}
    assert nees(estimates[-1], samples[-1].truth) < chi2.isf(1e-4, 6)
    assert all(each.status != EstimateStatus.DIVERGED for each in estimates)


def test_innovations_beyond_the_gate_are_given_with_their_test_ratio() -> None:
    setup = parameters(tick=10.0, gate=4.0)
    samples = list(simulate(setup, 12, np.random.default_rng(28)))
    filter = navigation_filter(setup)
    run(filter, samples[:10])
    estimate = filter.on_tick(off_by(samples[10].measurement, 60.0, place=0))
    assert estimate is not None
    assert used(estimate) == ["range_rate", "latitude"]
    by_sensor = {each.sensor: each for each in estimate.innovations}
    assert {name: each.rejection for name, each in by_sensor.items()} == {
        "range_rate": "",
        "latitude": "",
        "radius": Rejection.GATE,
    }
    for each in by_sensor.values():
        (value,), (sigma,) = each.values, each.standard_deviations
        assert each.test_ratio == pytest.approx(abs(value) / (4.0 * sigma), rel=1e-12)
    # 60 m beside a predicted deviation of 5 m and a little, of a gate at four
    assert by_sensor["radius"].test_ratio == pytest.approx(60.0 / (4.0 * 5.0), rel=0.35)


def test_an_outage_is_predicted_over_as_coasting() -> None:
    setup = parameters(tick=10.0)
    samples = [
        Sample(
            sample.truth,
            replace(sample.measurement, readings=[]) if 100 <= index < 160 else sample.measurement,
        )
        for index, sample in enumerate(simulate(setup, 300, np.random.default_rng(12)))
    ]
    estimates = run(navigation_filter(setup), samples)
    statuses = [each.status for each in estimates]
    assert set(statuses[107:160]) == {EstimateStatus.COASTING}
    assert set(statuses[160:]) == {EstimateStatus.TRACKING}
    error = estimates[160].relative_state - samples[160].truth
    assert (np.abs(error) < 4.0 * np.sqrt(np.diag(estimates[160].covariance))).all()


def test_an_unknown_manoeuvre_inflates_the_covariance() -> None:
    setup, push = parameters(tick=10.0), np.array([0.5, 0.5, 0.5])
    rng = np.random.default_rng(13)
    samples = list(simulate(setup, 60, rng))
    hidden = list(simulate(setup, 400, rng, push, start=samples[-1].truth))
    chief = samples[-1].measurement
    assert chief is not None
    stream = [
        Sample(sample.truth, replace(sample.measurement, applied_force=np.zeros(3), fix_available=index == 0))
        for index, sample in enumerate(hidden)
    ]
    estimates = run(navigation_filter(setup), stream)
    assert any(each.status == EstimateStatus.DIVERGED for each in estimates)
    assert all(np.isfinite(each.relative_state).all() for each in estimates)


def test_thrust_acts_on_the_mass_that_its_tick_began_with() -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 3, np.random.default_rng(31)))

    def velocity(masses: tuple[float, float, float], force: float = 0.1) -> float:
        """Cross-track, after two ticks of the force, without readings."""
        measurements = [
            replace(sample.measurement, readings=[], applied_force=np.array([0.0, 0.0, force * (index > 0)]), mass=mass)
            for index, (sample, mass) in enumerate(zip(samples, masses, strict=True))
        ]
        filter = navigation_filter(setup)
        estimates = [filter.on_tick(each) for each in measurements]
        assert estimates[-1] is not None
        return float(estimates[-1].relative_state[5])

    coasting, full = velocity((100.0, 100.0, 100.0), 0.0), velocity((100.0, 100.0, 100.0))
    assert velocity((100.0, 100.0, 95.0)) == full
    assert velocity((100.0, 95.0, 95.0)) - coasting == pytest.approx(
        (1.0 + 1.0 / 0.95) / 2.0 * (full - coasting), rel=1e-3
    )


def test_a_wrong_fix_is_recovered_from_by_inflation() -> None:
    """A fix 1 km off radially at a sigma of 0.5 m: the gates reject everything until the covariance covers it."""
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 580, np.random.default_rng(14)))
    samples[0].measurement.fix[:] += [1000.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    filter = navigation_filter(setup)
    estimates = run(filter, samples)
    assert any(each.status == EstimateStatus.DIVERGED for each in estimates)
    assert estimates[-1].status == EstimateStatus.TRACKING
    assert any(event.kind == EventKind.DIVERGED for event in filter.take_events())
    assert abs(estimates[-1].relative_state[0] - samples[-1].truth[0]) < 20.0


def test_a_state_beyond_inflation_is_lost_until_a_fix_comes() -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 100, np.random.default_rng(15)))
    samples[0].measurement.fix[:] += [0.0, 0.0, 4e5, 0.0, 0.0, 0.0]
    filter = navigation_filter(setup)
    silent = None
    for sample in samples:
        measurement = sample.measurement
        if silent is not None:  # what the plant does after a missed tick
            measurement = replace(measurement, fix_available=True, fix=sample.truth)
        estimate = filter.on_tick(measurement)
        if silent is not None:
            assert estimate is not None
            assert estimate.status == EstimateStatus.ACQUIRED
            break
        if estimate is None:
            silent = measurement.time
    assert silent is not None


def changed(sample: Sample, **changes: Any) -> Sample:
    return Sample(sample.truth, replace(sample.measurement, **changes))


@pytest.mark.parametrize("ephemeris", ["nan", "frozen", "zero"])
def test_a_chief_without_ephemeris_is_propagated(ephemeris: str) -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 200, np.random.default_rng(16)))
    frozen = samples[99].measurement.chief_state
    wrong = {"nan": np.full(6, np.nan), "frozen": frozen, "zero": np.zeros(6)}[ephemeris]
    stream = [
        changed(sample, chief_state=wrong) if 100 <= index < 150 else sample for index, sample in enumerate(samples)
    ]
    estimates = run(navigation_filter(setup), stream)
    assert len(estimates) == 200
    assert {each.status for each in estimates[100:150]} == {EstimateStatus.CHIEF_LOST}
    assert rejections(estimates[-1]) == {Rejection.CHIEF: 50}
    assert estimates[-1].status == EstimateStatus.TRACKING
    assert nees(estimates[149], samples[149].truth) < chi2.isf(1e-4, 6)
    assert nees(estimates[-1], samples[-1].truth) < chi2.isf(1e-4, 6)


def test_an_ephemeris_that_resumes_elsewhere_is_accepted() -> None:
    """A manoeuvre of the chief, or a corrected ephemeris: two states in a row that fit make an orbit."""
    setup = parameters(tick=10.0)
    other = Elements(**vars(replace(LEO, true_anomaly=1e-4)))  # 700 m ahead
    samples = list(simulate(setup, 40, np.random.default_rng(17)))
    chief = state_from_elements(other)
    stream = []
    for index, sample in enumerate(samples):
        stream.append(changed(sample, chief_state=chief) if index >= 20 else sample)
        chief = coast(chief, np.zeros(3), 10.0, 1)
    estimates = run(navigation_filter(setup), stream)
    assert estimates[20].status == EstimateStatus.CHIEF_LOST
    assert estimates[21].status == EstimateStatus.TRACKING
    assert rejections(estimates[-1]) == {Rejection.CHIEF: 1}
    assert estimates[-1].relative_state[1] == pytest.approx(samples[-1].truth[1] - 697.81, abs=20.0)


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda m: with_first(m, values=[np.nan]), Rejection.NOT_FINITE),
        (lambda m: with_first(m, values=[np.inf]), Rejection.NOT_FINITE),
        (lambda m: with_first(m, values=[]), Rejection.NOT_FINITE),
        (lambda m: with_first(m, values=m.readings[0].values * 2), Rejection.NOT_FINITE),
        (lambda m: off_by(m, 1e3), Rejection.GATE),
        (lambda m: with_first(m, values=[1e300]), Rejection.GATE),
        (lambda m: with_first(m, age=-10 * NANOSECONDS), Rejection.FUTURE),
        (lambda m: with_first(m, age=10**18), Rejection.LATE),
        (lambda m: replace(m, readings=[*m.readings, m.readings[0]]), Rejection.DUPLICATE),
        (lambda m: with_first(m, age=10 * NANOSECONDS), Rejection.DUPLICATE),  # used a tick ago
        (lambda m: with_first(m, sensor="sextant"), Rejection.UNKNOWN_SENSOR),
        (lambda m: replace(m, applied_force=np.full(3, np.nan)), Rejection.AVIONICS),
        (lambda m: replace(m, mass=np.nan), Rejection.AVIONICS),
        (lambda m: replace(m, mass=0.0), Rejection.AVIONICS),
        (lambda m: replace(m, mass=10.0 * m.mass), Rejection.AVIONICS),
        (lambda m: replace(m, mass=0.01 * m.mass), Rejection.AVIONICS),
        (lambda m: replace(m, chief_state=m.chief_state * np.nan), Rejection.CHIEF),
        (lambda m: replace(m, fix_available=True, fix=m.fix * np.nan), Rejection.FIX),
    ],
)
def test_invalid_input_is_rejected_and_the_rest_is_used(
    spoil: Callable[[Measurement], Measurement], reason: Rejection
) -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 12, np.random.default_rng(18)))
    filter = navigation_filter(setup)
    run(filter, samples[:10])
    estimate = filter.on_tick(spoil(samples[10].measurement))
    assert estimate is not None
    assert rejections(estimate) == {reason: 1}
    assert any(event.kind == EventKind.REJECTED for event in filter.take_events())
    after = filter.on_tick(samples[11].measurement)
    assert after is not None
    assert used(after) == [each.sensor for each in samples[11].measurement.readings]
    assert nees(after, samples[11].truth) < chi2.isf(1e-4, 6)


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda m: replace(m, deputy="deputy2"), Rejection.WRONG_DEPUTY),
        (lambda m: replace(m, time=m.time - 10_000_000_000), Rejection.DUPLICATE),
        (lambda m: replace(m, time=m.time - 50_000_000_000), Rejection.OUT_OF_ORDER),
        (lambda m: replace(m, time=m.time + 10**16), Rejection.FUTURE),
    ],
)
def test_a_measurement_out_of_sequence_changes_nothing(
    spoil: Callable[[Measurement], Measurement], reason: Rejection
) -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 12, np.random.default_rng(19)))
    spoilt, clean = navigation_filter(setup), navigation_filter(setup)
    run(spoilt, samples[:10])
    run(clean, samples[:10])
    assert spoilt.on_tick(spoil(samples[10].measurement)) is None
    one, other = spoilt.on_tick(samples[10].measurement), clean.on_tick(samples[10].measurement)
    assert one is not None
    assert other is not None
    assert rejections(one) == {reason: 1}
    assert one.covariance.tobytes() == other.covariance.tobytes()


def test_missing_ticks_are_predicted_over() -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 60, np.random.default_rng(20)))
    stream = samples[:20] + samples[40:]
    estimates = run(navigation_filter(setup), stream)
    assert len(estimates) == 40
    assert nees(estimates[20], samples[40].truth) < chi2.isf(1e-4, 6)


def test_a_new_run_starts_with_new_counts() -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 20, np.random.default_rng(21)))
    filter = navigation_filter(setup)
    first = run(filter, samples)
    filter.on_tick(replace(samples[19].measurement, time=5))
    again = run(filter, samples)
    assert [each.relative_state.tobytes() for each in again] == [each.relative_state.tobytes() for each in first]
    assert not again[-1].rejections


NAN3, NAN6 = np.full(3, np.nan), np.full(6, np.nan)
SPOILS: dict[str, Callable[[Measurement], Measurement]] = {
    "nan reading": lambda m: with_all(m, values=[np.nan]),
    "huge reading": lambda m: with_all(m, values=[1e308]),
    "negative reading": lambda m: replace(m, readings=[replace(r, values=[-r.values[0]]) for r in m.readings]),
    "zero reading": lambda m: with_all(m, values=[0.0]),
    "future": lambda m: with_all(m, age=-NANOSECONDS),
    "old": lambda m: with_all(m, age=45 * NANOSECONDS),
    "no readings": lambda m: replace(m, readings=[]),
    "no values": lambda m: with_all(m, values=[]),
    "two values": lambda m: with_all(m, values=[1.0, 2.0]),
    "other sensors": lambda m: with_all(m, sensor="sextant"),
    "wrong sensors": lambda m: replace(
        m, readings=[replace(r, sensor=o.sensor) for r, o in zip(m.readings, m.readings[::-1], strict=True)]
    ),
    "same sensor": lambda m: with_all(m, sensor="radius"),
    "nan chief": lambda m: replace(m, chief_state=NAN6),
    "zero chief": lambda m: replace(m, chief_state=np.zeros(6)),
    "huge chief": lambda m: replace(m, chief_state=np.full(6, 1e200)),
    "frozen chief": lambda m: replace(m, chief_state=np.array([7e6, 0, 0, 0, 5e3, 5e3])),
    "nan force": lambda m: replace(m, applied_force=NAN3),
    "huge force": lambda m: replace(m, applied_force=np.full(3, 1e300)),
    "large force": lambda m: replace(m, applied_force=np.full(3, 1e5)),
    "no mass": lambda m: replace(m, mass=0.0),
    "tiny mass": lambda m: replace(m, mass=1e-300),
    "nan mass": lambda m: replace(m, mass=np.nan),
    "wrong deputy": lambda m: replace(m, deputy="other"),
    "far future": lambda m: replace(m, time=m.time + 2**61),
    "soon": lambda m: replace(m, time=m.time + 3_000_000_001),
    "past": lambda m: replace(m, time=max(0, m.time - 25_000_000_000)),
    "nan fix": lambda m: replace(m, fix_available=True, fix=NAN6),
    "far fix": lambda m: replace(m, fix_available=True, fix=np.full(6, 1e300)),
    "large fix": lambda m: replace(m, fix_available=True, fix=np.full(6, 3e5)),
    "zero fix": lambda m: replace(m, fix_available=True, fix=np.zeros(6)),
    "past with a fix": lambda m: replace(m, fix_available=True, time=max(0, m.time - 25_000_000_000)),
}

FLIGHT = list(simulate(parameters(tick=10.0), 40, np.random.default_rng(22)))


def check(estimate: Estimate) -> None:
    assert np.isfinite(estimate.relative_state).all()
    assert np.isfinite(estimate.chief_state).all()
    assert np.isfinite(estimate.unobservable_direction).all()
    assert np.isfinite([estimate.nis, estimate.mass]).all()
    for innovation in estimate.innovations:
        numbers = [*innovation.values, *innovation.standard_deviations, innovation.test_ratio]
        assert np.isfinite(numbers).all()
        assert (innovation.test_ratio > 1.0) == (innovation.rejection == Rejection.GATE)
    scale = np.sqrt(np.diag(estimate.covariance))
    assert np.isfinite(scale).all()
    assert (scale > 0.0).all()
    # symmetric to the bit, and positive definite whatever the units
    assert (estimate.covariance == estimate.covariance.T).all()
    assert np.linalg.eigvalsh(estimate.covariance / np.outer(scale, scale))[0] > 0.0


@given(
    st.lists(
        st.tuples(st.integers(0, 39), st.integers(1, 12), st.sampled_from(sorted(SPOILS))),
        min_size=1,
        max_size=8,
    ),
    st.lists(st.integers(0, 39), max_size=5),
    st.lists(st.tuples(st.integers(0, 39), st.integers(0, 39)), max_size=3),
    st.sampled_from(["ekf", "ukf"]),
    st.sampled_from(["nonlinear_j2", "hill"]),
    st.booleans(),
)
@settings(max_examples=60)
@pytest.mark.thorough
def test_estimates_stay_finite_and_definite_for_any_stream(
    spoils: list[tuple[int, int, str]],
    doubled: list[int],
    exchanged: list[tuple[int, int]],
    filter: str,
    model: str,
    pseudo: bool,
) -> None:
    stream = [sample.measurement for sample in FLIGHT]
    for start, count, name in spoils:
        for index in range(start, min(40, start + count)):
            stream[index] = SPOILS[name](stream[index])
    for one, other in exchanged:
        stream[one], stream[other] = stream[other], stream[one]
    for index in doubled:
        stream.insert(index, stream[index])
    setup = parameters(tick=10.0, filter=filter, process_model=model, pseudo_measurements=pseudo)
    filter_ = navigation_filter(setup)
    silent = True
    for measurement in stream:
        estimate = filter_.on_tick(measurement)
        silent = estimate is None
        if estimate is not None:
            check(estimate)
    # Whatever has happened: with a good fix after a silent tick, as the plant gives it, it flies on.
    for index, sample in enumerate(simulate(setup, 4, np.random.default_rng(23))):
        measurement = replace(sample.measurement, time=(1000 + index) * setup.tick_ns, fix_available=True)
        estimate = filter_.on_tick(replace(measurement, fix=sample.truth))
        if estimate is not None:
            check(estimate)
            silent = False
    assert not silent


def test_estimates_stay_finite_above_the_pole() -> None:
    setup = parameters(Orbit(7e6, inclination=radians(90.0), true_anomaly=radians(90.0)), tick=10.0)
    samples = list(simulate(setup, 10, np.random.default_rng(24), start=np.zeros(6)))
    samples[0].measurement.fix[:] = 0.0
    estimates = run(navigation_filter(setup), samples)
    assert len(estimates) == 10
    for estimate in estimates:
        check(estimate)


@pytest.mark.parametrize(
    "changes",
    [
        {"sensors": ["radius", "sextant"]},
        {"sensors": []},
        {"sensors": ["radius", "radius"]},
        {"radius_sigma": 0.0},
        {"latitude_sigma": -1e-6},
        {"fix_position_sigma": 0.0},
        {"acceleration_density": -1.0},
        {"acceleration_density": float("nan")},
        {"gate": 0.0},
        {"filter": "particle"},
        {"process_model": "kepler"},
    ],
)
def test_parameters_that_make_no_covariance_are_rejected(changes: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(changes))):
        load(NavigationParameters, {"chief.semi_major_axis": 7e6, **changes})


def test_an_available_fix_is_used_when_the_filter_diverges() -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 30, np.random.default_rng(25)))
    samples[0].measurement.fix[:] += [1000.0, 0.0, 1000.0, 1.0, 0.0, 0.0]
    stream = [
        changed(sample, fix_available=True, fix=sample.truth) if index == 4 else sample
        for index, sample in enumerate(samples)
    ]  # the fifth update in which the gates reject everything
    estimates = run(navigation_filter(setup), stream)
    assert [each.status for each in estimates].count(EstimateStatus.ACQUIRED) == 2
    assert estimates[4].status == EstimateStatus.ACQUIRED
    assert used(estimates[4]) == [each.sensor for each in samples[4].measurement.readings]
    assert nees(estimates[-1], samples[-1].truth) < chi2.isf(1e-4, 6)


def test_a_faulty_sensor_alone_is_no_divergence() -> None:
    setup = parameters(tick=10.0)
    stream = [
        Sample(sample.truth, off_by(sample.measurement, 500.0))
        for sample in simulate(setup, 200, np.random.default_rng(26))
    ]
    estimates = run(navigation_filter(setup), stream)
    assert rejections(estimates[-1]) == {Rejection.GATE: 200}
    assert {each.status for each in estimates[1:]} == {EstimateStatus.TRACKING}


def test_readings_of_unused_sensors_change_nothing() -> None:
    setup = parameters(tick=10.0)
    samples = list(simulate(replace(setup, sensors=(*THREE, "chief_range")), 50, np.random.default_rng(27)))
    bare = [changed(sample, readings=sample.measurement.readings[:3]) for sample in samples]
    one, other = run(navigation_filter(setup), samples)[-1], run(navigation_filter(setup), bare)[-1]
    assert one.covariance.tobytes() == other.covariance.tobytes()
    assert not one.rejections


def test_an_isolated_sensor_is_compared_and_changes_nothing() -> None:
    """However far off: state and covariance are those without the sensor, bit for bit."""
    setup = parameters(tick=10.0)
    samples = list(simulate(setup, 100, np.random.default_rng(31)))
    alone = run(navigation_filter(replace(setup, sensors=THREE[1:])), samples)
    filter = navigation_filter(setup)
    mode = ModeState(0, Mode.KEEP, Mode.KEEP, 0, restrictions=[Restriction("sensor", "radius", "at fault")])
    for sample, expected in zip(samples, alone, strict=True):
        estimate = filter.on_tick(off_by(sample.measurement, 1e5), mode)
        assert estimate is not None
        assert estimate.relative_state.tobytes() == expected.relative_state.tobytes()
        assert estimate.covariance.tobytes() == expected.covariance.tobytes()
        assert (estimate.nis, estimate.status) == (expected.nis, expected.status)
        assert {each.sensor: each.rejection for each in estimate.innovations} == {
            "radius": Rejection.ISOLATED,
            "range_rate": "",
            "latitude": "",
        }
        assert estimate.rejections == []


def test_a_sensor_in_use_that_never_reads_is_reported() -> None:
    setup = parameters(sensors=(*THREE, "chief_range"))
    samples = list(simulate(replace(setup, sensors=THREE), 200, np.random.default_rng(29)))
    filter = navigation_filter(setup)
    run(filter, samples)
    events = [event for event in filter.take_events() if event.kind == EventKind.WARNING]
    assert [(event.subject, event.tick) for event in events] == [("chief_range", 60)]  # ten times coasting_after
    assert "never" in events[0].detail


def test_a_sensor_that_falls_silent_is_reported_and_so_is_its_return() -> None:
    setup = parameters()
    stream = [
        changed(sample, readings=sample.measurement.readings[1:]) if 50 <= index < 150 else sample
        for index, sample in enumerate(simulate(setup, 250, np.random.default_rng(30)))
    ]
    filter = navigation_filter(setup)
    run(filter, stream)
    events = [event for event in filter.take_events() if event.kind == EventKind.WARNING]
    assert [event.subject for event in events] == ["radius", "radius"]
    assert 50 < events[0].tick < 150 <= events[1].tick
