"""The nearest approach against every pair at every instant."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.analysis.separation import minimum_separation


@settings(deadline=None)
@given(st.integers(2, 5), st.integers(1, 20), st.integers(0, 1000))
def test_no_pair_is_ever_nearer(satellites: int, instants: int, seed: int) -> None:
    positions = np.random.default_rng(seed).normal(size=(satellites, instants, 3))
    times, names = 10.0 * np.arange(instants), [f"s{index}" for index in range(satellites)]
    found = minimum_separation(times, positions, names)
    assert found is not None
    every = {
        (times[k], names[i], names[j]): math.dist(positions[i, k], positions[j, k])
        for k in range(instants)
        for i in range(satellites)
        for j in range(i + 1, satellites)
    }
    assert found.distance == pytest.approx(min(every.values()))
    assert every[found.time, *found.pair] == pytest.approx(found.distance)


def test_one_satellite_is_near_to_none() -> None:
    assert minimum_separation(np.zeros(1), np.zeros((1, 1, 3)), ["alone"]) is None
