"""NEES and NIS of every shipped scenario over a hundred seeds, with the truth's own forces."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from formation_gnc.records import EstimateStatus
from formation_gnc.sil.monte_carlo import nees
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

SEEDS = 100

DURATION = {"geostationary": 172800.0}
"""Time that is flown, s; more than an orbit of the others."""

ALARM = 1e-4
"""Probability that a consistent filter leaves a band."""


def statistics(scenario: str, seed: int, overrides: dict[str, Any] | None = None) -> tuple[float, float]:
    """Mean NEES over its expected 6, and mean NIS over the number of values, of all deputies of a flight."""
    plant = {"seed": seed, "duration": DURATION.get(scenario, 9000.0)}
    run = Run(load_scenario(scenario, {"/**/plant": plant, **(overrides or {})}))
    records: dict[str, Any] = {}
    squares, nis, values = [], 0.0, 0
    while not run.plant.finished:
        run.tick(records.__setitem__)
        for deputy in records["/truth"].deputies:
            estimate = records[f"/{deputy.name}/estimate"]
            used = sum(len(each.values) for each in estimate.innovations if not each.rejection)
            if estimate.status == EstimateStatus.TRACKING and used:
                squares.append(nees(estimate, deputy.relative_state))
                nis, values = nis + estimate.nis, values + used
    return float(np.mean(squares)) / 6.0, nis / values


@pytest.mark.slow
@pytest.mark.parametrize(
    "scenario", ["leader_follower", "geostationary", "eccentric_leo", "tetrahedral", "projected_circle"]
)
def test_nees_and_nis_of_shipped_scenarios_are_within_their_bands(scenario: str) -> None:
    """Means over time, whose scatter is at most that of a hundred values at one time: chi-square of these."""
    of_nees, of_nis = np.mean([statistics(scenario, seed) for seed in range(1, SEEDS + 1)], axis=0)
    for mean, freedom in ((of_nees, 6 * SEEDS), (of_nis, 3 * SEEDS)):
        assert chi2.ppf(ALARM / 2.0, freedom) / freedom < mean < chi2.isf(ALARM / 2.0, freedom) / freedom
