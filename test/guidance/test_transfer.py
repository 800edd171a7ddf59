"""Shortest time and delta-v of transfers, against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.guidance.transfer import LONGEST, delta_v, shortest_time

RATE = 1.0618e-3
LIMITS = np.full(3, 1e-4)  # 10 mN on 100 kg

errors = st.lists(st.floats(-500.0, 500.0), min_size=6, max_size=6).map(
    lambda numbers: np.array(numbers) * np.repeat([1.0, RATE], 3)
)


@given(st.floats(0.01, 1.0))
@pytest.mark.thorough
@pytest.mark.covers("Kremmydas 3.1.1", "guidance/transfer.py")
def test_short_cross_track_transfer_takes_the_bang_bang_time(distance: float) -> None:
    # 2 sqrt(d / a): accelerate half the way, brake the other half; the orbit is negligible over such times
    soonest = shortest_time(np.array([0.0, 0.0, distance, 0.0, 0.0, 0.0]), np.full(3, 1e-2), RATE)
    assert soonest == pytest.approx(2.0 * math.sqrt(distance / 1e-2), rel=0.02)  # found to 0.01, from above


@settings(max_examples=15)
@given(errors)
@pytest.mark.thorough
def test_twice_the_thrust_is_never_slower(error: np.ndarray) -> None:
    # found to one per cent
    assert shortest_time(error, 2.0 * LIMITS, RATE) <= 1.02 * shortest_time(error, LIMITS, RATE)


def test_no_error_takes_no_time_and_no_thrust_never_arrives() -> None:
    assert shortest_time(np.zeros(6), LIMITS, RATE) == 0.0
    assert shortest_time(np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), np.array([1e-4, 1e-4, 0.0]), RATE) == math.inf


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value")
@pytest.mark.parametrize("size", [1e30, 1e150, 1e300, 1.7e308])
@pytest.mark.parametrize("limit", [1e-4, 1e-300, 1e308])
def test_an_error_as_large_as_a_float_is_out_of_reach(size: float, limit: float) -> None:
    for error in size * np.vstack([np.eye(6), np.ones((1, 6))]):
        assert shortest_time(error, np.full(3, limit), RATE) in (math.inf, 0.0) or limit > 1.0


def test_transfer_with_kremmydas_thrusters_takes_over_a_revolution() -> None:
    # 8 uN on 1.5 kg, from rest a kilometre ahead to the in-plane ellipse of a kilometre: half a m/s
    error = np.array([0.0, 0.0, 0.0, 0.5 * 1000.0 * RATE, 0.0, 0.0])
    soonest = shortest_time(error, np.full(3, 8e-6 / 1.5), RATE)
    assert 1.0 < soonest * RATE / math.tau < LONGEST


@given(errors, st.floats(500.0, 20_000.0), st.floats(0.1, 10.0))
def test_delta_v_is_proportional_to_the_error(error: np.ndarray, duration: float, factor: float) -> None:
    one, other = delta_v(np.array([error, factor * error]), duration, RATE)
    assert other == pytest.approx(factor * one, rel=1e-9)


@given(st.floats(-1.0, 1.0))
def test_delta_v_of_a_fast_change_of_cross_track_rate(rate: float) -> None:
    # double integrator: u(t) = 4 v / T - 6 v t / T^2, which sums to 5/3 v
    cost = delta_v(np.array([0.0, 0.0, 0.0, 0.0, 0.0, rate]), 10.0, RATE)
    assert cost == pytest.approx(5.0 / 3.0 * abs(rate), rel=0.01)
