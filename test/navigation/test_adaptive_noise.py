"""Readings worse than their parameters say: noisier sensors and outliers, of each sensor, by every filter."""

from collections.abc import Iterator
from dataclasses import replace
from math import radians
from typing import Any

import numpy as np
import pytest

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


def spoilt(
    parameters: NavigationParameters, measurement: Measurement, sensor: str, noise: float, outliers: float, rng: Any
) -> Measurement:
    """The measurement with more noise on a sensor's reading, or an outlier of 50 standard deviations."""
    (sigma,) = parameters.sigmas[sensor]
    readings = []
    for reading in measurement.readings:
        if reading.sensor == sensor:
            error = sigma * np.sqrt(noise**2 - 1.0) * rng.standard_normal()
            if rng.random() < outliers:
                error += 50.0 * sigma * rng.choice([-1.0, 1.0])
            reading = replace(reading, values=[reading.values[0] + error])
        readings.append(reading)
    return replace(measurement, readings=readings)


def fly(
    sensor: str, noise: float, outliers: float, ticks: int, seed: int = 1, **changes: Any
) -> tuple[np.ndarray, np.ndarray, NavigationFilter]:
    """Position errors (m) and NEES of every tick, and the filter."""
    parameters = NavigationParameters(chief=POLAR, tick=10.0, **changes)
    truth = replace(parameters, acceleration_density=1e-14)  # a filter's model errors are no motion of the truth
    filter, rng = navigation_filter(parameters), np.random.default_rng(seed + 6)

    def estimates() -> Iterator[tuple[float, float]]:
        for sample in simulate_measurements(truth, ticks, np.random.default_rng(seed)):
            estimate = filter.on_tick(spoilt(parameters, sample.measurement, sensor, noise, outliers, rng))
            assert estimate is not None
            error = estimate.relative_state - sample.truth
            yield float(np.linalg.norm(error[:3])), nees(estimate, sample.truth)

    errors, squares = np.array(list(estimates())).T
    return errors, squares, filter


@pytest.mark.parametrize("sensor", THREE)
@pytest.mark.parametrize(("noise", "outliers"), TROUBLES)
def test_three_sensors_stay_within_metres_of_the_truth(sensor: str, noise: float, outliers: float) -> None:
    errors, squares, _ = fly(sensor, noise, outliers, ORBIT, sensors=THREE)
    assert errors.max() < 10.0
    assert squares.mean() < 12.0


@pytest.mark.parametrize("sensor", FIVE)
@pytest.mark.parametrize(("noise", "outliers"), TROUBLES)
@pytest.mark.thorough
def test_five_sensors_stay_within_metres_of_the_truth(sensor: str, noise: float, outliers: float) -> None:
    runs = [fly(sensor, noise, outliers, ORBIT, seed, sensors=FIVE) for seed in (1, 2)]
    assert max(errors.max() for errors, _, _ in runs) < 10.0
    assert np.mean([squares for _, squares, _ in runs]) < 12.0  # one run alone has few independent errors


@pytest.mark.thorough
def test_radius_noise_does_not_wind_up_over_three_orbits() -> None:
    errors, squares, _ = fly("radius", 2.0, 0.0, 3 * ORBIT, sensors=THREE)
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
        errors, squares, _ = fly("radius", noise, outliers, ORBIT // 2, sensors=THREE, **changes)
        assert errors.max() < 15.0
        assert squares.mean() < 12.0


def test_a_noisier_sensor_is_named_with_its_noise_and_again_when_well() -> None:
    _, _, filter = fly("latitude", 3.0, 0.0, ORBIT, sensors=THREE)
    events = [each for each in filter.take_events() if each.kind == EventKind.WARNING]
    assert {each.subject for each in events} == {"latitude"}
    assert "latitude_sigma" in events[0].detail
    _, _, filter = fly("latitude", 1.0, 0.0, ORBIT, sensors=THREE)
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
