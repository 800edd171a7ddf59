"""NEES and NIS of every shipped scenario over a hundred seeds, with the truth's own forces."""

from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest
from scipy.stats import chi2

from formation_gnc.sil.monte_carlo import flight_statistics

SEEDS = 100

DURATION = {
    "leader_follower": 6000.0,
    "geostationary": 172800.0,
    "eccentric_leo": 6500.0,
    "tetrahedral": 2400.0,
    "projected_circle": 1200.0,
}
"""Time that is flown, s: an orbit, two at GEO, where unmodelled forces add up. Less of the fleets, which have four and
eight filters to a flight, and the forces of leader_follower."""

ALARM = 1e-4
"""Probability that a consistent filter leaves a band."""


def is_within_band(mean: float, freedom: int) -> bool:
    """Whether the mean of chi-square variables, over what is expected, is as far from 1 as these all together allow."""
    return bool(chi2.ppf(ALARM / 2.0, freedom) < mean * freedom < chi2.isf(ALARM / 2.0, freedom))


@pytest.mark.slow
@pytest.mark.parametrize("scenario", list(DURATION))
def test_nees_and_nis_of_shipped_scenarios_are_within_their_bands(scenario: str) -> None:
    """NEES changes slowly: its mean over time scatters at most as at one time. Innovations are independent."""
    fly = partial(flight_statistics, scenario, duration=DURATION[scenario])
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        flights = list(pool.map(fly, range(1, SEEDS + 1)))
    nees, nis, values = np.array(flights).T
    assert is_within_band(nees.mean() / 6.0, 6 * SEEDS)
    assert is_within_band(nis @ values / values.sum(), round(values.sum()))
