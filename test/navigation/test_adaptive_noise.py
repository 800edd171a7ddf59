"""Readings worse than their parameters say: noisier sensors and outliers, of each sensor, by every filter."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.common import Orbit
from formation_gnc.navigation.navigation_filter import NavigationFilter
from formation_gnc.navigation.observability import Observability, orbit_period
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.records import EventKind, Measurement
from formation_gnc.sil.monte_carlo import navigation_filter, nees, simulate_measurements

POLAR = Orbit(6978100.0, inclination=radians(85.0))
THREE = ("radius", "range_rate", "latitude")
FIVE = (*THREE, "right_ascension", "chief_range")
ORBIT = 580
"""Ticks."""

TROUBLES = [(2.0, 0.0), (5.0, 0.0), (1.0, 0.1), (1.0, 0.3)]
"""Noise over what the filter assumes, and share of outliers."""


@dataclass(frozen=True)
class Trouble:
    """What is wrong with readings."""

    sensors: tuple[str, ...]
    noise: float = 1.0
    """Standard deviation over what the filter assumes."""
    outliers: float = 0.0
    """Share of the readings."""
    size: float = 50.0
    """Of an outlier, in standard deviations."""
    ticks: tuple[int, int] = (0, 10**9)
    """First tick, and the first without it."""
    is_silent: bool = False


def spoilt(parameters: NavigationParameters, measurement: Measurement, trouble: Trouble, rng: Any) -> Measurement:
    """The measurement with more noise on the sensors' readings, with outliers, or without the readings."""
    readings = []
    for reading in measurement.readings:
        if reading.sensor in trouble.sensors:
            if trouble.is_silent:
                continue
            (sigma,) = parameters.sigmas[reading.sensor]
            error = sigma * np.sqrt(trouble.noise**2 - 1.0) * rng.standard_normal()
            if rng.random() < trouble.outliers:
                error += trouble.size * sigma * rng.choice([-1.0, 1.0])
            reading = replace(reading, values=[reading.values[0] + error])
        readings.append(reading)
    return replace(measurement, readings=readings)


def fly(
    troubles: Sequence[Trouble],
    ticks: int = ORBIT,
    seed: int = 1,
    fix_error: float = 0.0,
    gap: tuple[int, int] = (0, 0),
    **changes: Any,
) -> tuple[np.ndarray, np.ndarray, NavigationFilter]:
    """Position errors (m) and NEES of every tick, and the filter.

    Args:
        troubles: of the readings.
        ticks: of the flight, the first with the fix.
        seed: of all noise.
        fix_error: of the fix on each axis of the position, m.
        gap: ticks without a measurement: the first, and the first after them.
        changes: parameters of the filter.
    """
    parameters = NavigationParameters(chief=POLAR, tick=10.0, **changes)
    truth = replace(parameters, acceleration_density=1e-14)  # a filter's model errors are no motion of the truth
    filter, rng = navigation_filter(parameters), np.random.default_rng(seed + 6)
    off = np.repeat([fix_error, 0.0], 3)

    def estimates() -> Iterator[tuple[float, float]]:
        for tick, sample in enumerate(simulate_measurements(truth, ticks, np.random.default_rng(seed))):
            measurement = sample.measurement
            for trouble in troubles:
                if trouble.ticks[0] <= tick < trouble.ticks[1]:
                    measurement = spoilt(parameters, measurement, trouble, rng)
            if gap[0] <= tick < gap[1]:
                continue
            estimate = filter.on_tick(replace(measurement, fix=measurement.fix + off))
            assert estimate is not None
            error = estimate.relative_state - sample.truth
            yield float(np.linalg.norm(error[:3])), nees(estimate, sample.truth)

    errors, squares = np.array(list(estimates())).T
    assert np.isfinite(errors).all()
    assert (squares >= 0.0).all()
    return errors, squares, filter


def divergences(filter: NavigationFilter) -> int:
    return sum(each.kind == EventKind.DIVERGED for each in filter.take_events())


@pytest.mark.parametrize("sensor", THREE)
@pytest.mark.parametrize(("noise", "outliers"), TROUBLES)
def test_three_sensors_stay_within_metres_of_the_truth(sensor: str, noise: float, outliers: float) -> None:
    errors, squares, _ = fly([Trouble((sensor,), noise, outliers)], sensors=THREE)
    assert errors.max() < 10.0
    assert squares.mean() < 12.0


@pytest.mark.parametrize("sensor", FIVE)
@pytest.mark.parametrize(("noise", "outliers"), TROUBLES)
@pytest.mark.thorough
def test_five_sensors_stay_within_metres_of_the_truth(sensor: str, noise: float, outliers: float) -> None:
    runs = [fly([Trouble((sensor,), noise, outliers)], seed=seed, sensors=FIVE) for seed in (1, 2)]
    assert max(errors.max() for errors, _, _ in runs) < 10.0
    assert np.mean([squares for _, squares, _ in runs]) < 12.0  # one run alone has few independent errors


@pytest.mark.thorough
def test_radius_noise_does_not_wind_up_over_three_orbits() -> None:
    errors, squares, _ = fly([Trouble(("radius",), 2.0)], 3 * ORBIT, sensors=THREE)
    assert errors.max() < 5.0  # kilometres where the covariance as a whole is inflated
    assert squares.mean() < 12.0


@pytest.mark.parametrize(
    "changes",
    [
        {"filter": "ukf"},
        {"pseudo_measurements": True},
        {"process_model": "hill", "acceleration_density": 5e-9},
        {"process_model": "schweighart_sedwick", "acceleration_density": 1e-9},
    ],
    ids=lambda changes: str(next(iter(changes.values()))),
)
@pytest.mark.thorough
def test_every_filter_stays_within_metres_of_the_truth(changes: dict[str, Any]) -> None:
    for noise, outliers in TROUBLES:
        errors, squares, _ = fly([Trouble(("radius",), noise, outliers)], ORBIT // 2, sensors=THREE, **changes)
        assert errors.max() < 15.0
        assert squares.mean() < 12.0


@pytest.mark.parametrize("sensors", [THREE, FIVE], ids=len)
@pytest.mark.parametrize(("noise", "outliers"), [*TROUBLES, (30.0, 0.0), (5.0, 0.3)])
@pytest.mark.thorough
def test_all_sensors_at_once_are_off_by_no_more_than_their_noise(
    sensors: tuple[str, ...], noise: float, outliers: float
) -> None:
    """White readings are no error of the state, however many are rejected; errors grow in proportion to the noise."""
    for seed in (1, 2):
        errors, squares, filter = fly([Trouble(sensors, noise, outliers)], seed=seed, sensors=sensors)
        assert errors.max() < 5.0 * noise + 5.0
        assert squares.mean() < 15.0  # of few independent errors: 12 over many flights
        assert divergences(filter) == 0


@pytest.mark.parametrize("sensors", [THREE, FIVE], ids=len)
def test_noise_that_comes_and_goes_in_flight_is_followed(sensors: tuple[str, ...]) -> None:
    errors, squares, filter = fly([Trouble(sensors, 5.0, ticks=(200, 300))], sensors=sensors)
    events = [each for each in filter.take_events() if each.kind == EventKind.WARNING]
    assert {each.subject for each in events if "weighted so" in each.detail} == set(sensors)
    assert {each.subject for each in events if each.detail == "noise as assumed again"} == set(sensors)
    assert errors.max() < 25.0  # one reading of the radius
    assert squares.mean() < 12.0


def test_a_noisy_sensor_that_pauses_is_no_divergence() -> None:
    noisy, silent = Trouble(("radius",), 5.0), Trouble(("radius",), ticks=(150, 300), is_silent=True)
    errors, squares, filter = fly([noisy, silent], sensors=THREE)
    assert divergences(filter) == 0
    assert errors.max() < 10.0
    assert squares.mean() < 12.0


def test_a_long_gap_among_noisy_readings_is_predicted_over() -> None:
    errors, squares, filter = fly([Trouble(FIVE, 5.0)], gap=(150, 300), sensors=FIVE)
    assert divergences(filter) == 0
    assert errors.max() < 15.0
    assert squares.mean() < 12.0


@pytest.mark.parametrize("noise", [1.0, 5.0])
def test_a_fix_far_off_is_an_error_of_the_state_whatever_the_noise(noise: float) -> None:
    """Its innovations are alike: the covariance is inflated until the readings bring the state back."""
    errors, _, filter = fly([Trouble(FIVE, noise)], fix_error=300.0, sensors=FIVE)
    assert divergences(filter) > 0
    assert errors[ORBIT // 2 :].max() < 5.0 * noise + 5.0


_troubles = st.builds(
    Trouble,
    sensors=st.sets(st.sampled_from(FIVE), min_size=1).map(sorted).map(tuple),
    noise=st.floats(1.0, 5.0),
    outliers=st.floats(0.0, 0.3),
    size=st.floats(1.0, 1e9),
    ticks=st.tuples(st.integers(0, 50), st.integers(0, 100)),
    is_silent=st.booleans(),
)


@pytest.mark.thorough
@settings(max_examples=8)
@given(troubles=st.lists(_troubles, max_size=3), filter=st.sampled_from(["ekf", "ukf"]), seed=st.integers(0, 1000))
def test_errors_stay_bounded_in_any_mixture_of_troubles(troubles: list[Trouble], filter: str, seed: int) -> None:
    """The fix is good: what the readings do to the state is no more than their noise would, every one taken.

    Up to what is to be stood; the unscented filter gives up at 19 times the noise of all with 30 % outliers.
    """
    errors, _, _ = fly(troubles, 100, seed, filter=filter, sensors=FIVE)
    assert errors.max() < 5.0 * 30.0


def test_a_noisier_sensor_is_named_with_its_noise_and_again_when_well() -> None:
    _, _, filter = fly([Trouble(("latitude",), 3.0)], sensors=THREE)
    events = [each for each in filter.take_events() if each.kind == EventKind.WARNING]
    assert {each.subject for each in events} == {"latitude"}
    assert "latitude_sigma" in events[0].detail
    _, _, filter = fly([], sensors=THREE)
    assert all(each.kind != EventKind.WARNING for each in filter.take_events())


def test_inflation_leaves_the_unobservable_direction_as_it_is() -> None:
    chief = state_from_elements(Elements(**vars(POLAR)))
    rate = 2.0 * np.pi / orbit_period(chief)
    variance: dict[str, tuple[float, ...]] = {"radius": (25.0,), "range_rate": (1e-4,), "latitude": (1e-12,)}
    observability = Observability(chief, np.array([10.0, -90.0, 10.0, 0.0, 0.0, 0.0]), variance, 5800.0, rate)
    root = np.random.default_rng(1).standard_normal((6, 6)) * np.repeat([1.0, rate], 3)[:, None]
    covariance = root @ root.T
    inflated = observability.inflate(covariance, 9.0)
    direction = observability.direction * np.repeat([1.0, rate], 3)
    # given all that readings see, the variance along the direction is what it was
    before, after = (direction @ np.linalg.solve(each, direction) for each in (covariance, inflated))
    assert after == pytest.approx(before, rel=1e-6)
    # of what readings see, it is inflated
    blind_to_it = np.linalg.svd(direction[None] / np.repeat([1.0, rate], 3))[2][1:] / np.repeat([1.0, rate], 3)
    assert blind_to_it @ inflated @ blind_to_it.T == pytest.approx(9.0 * blind_to_it @ covariance @ blind_to_it.T)
