"""Verdict on a run: held, acquiring or lost, from the distance to the target."""

import numpy as np
import pytest

from formation_gnc.analysis.verdict import ErrorHistory, Verdict
from formation_gnc.types import Vector

PERIOD = 6000.0
SIZE = 100.0


def history(error: Vector, orbits: float, changed: float = 0.0, answered: float = 1.0) -> ErrorHistory:
    """A run with an error given over it, whose last answer came after a share of it."""
    end = orbits * PERIOD
    time = np.linspace(0.0, end, len(error))
    rows = time <= answered * end
    return ErrorHistory(time[rows], error[rows], np.full(rows.sum(), SIZE), end, PERIOD, changed)


RUN = np.linspace(0.0, 1.0, 2000)


@pytest.mark.parametrize(
    ("error", "verdict"),
    [
        (3.0 + 40.0 * np.exp(-20.0 * RUN), Verdict.HELD),
        (5000.0 * np.exp(-2.0 * RUN), Verdict.ACQUIRING),
        (60.0 + 0.0 * RUN, Verdict.ACQUIRING),  # out of formation, but by less than its size
        (150.0 + 0.0 * RUN, Verdict.LOST),
        (10.0 + 18e3 * RUN**2, Verdict.LOST),
        (500.0 * (1.0 + np.sin(60.0 * RUN)), Verdict.LOST),  # swings, and does not settle
    ],
)
def test_verdict_is_that_of_the_last_orbit(error: Vector, verdict: Verdict) -> None:
    assert history(error, 4.0).verdict is verdict


def test_a_new_target_leaves_an_orbit_to_arrive() -> None:
    error = np.where(RUN > 0.9, 400.0, 2.0)
    assert history(error, 4.0).verdict is Verdict.LOST
    assert history(error, 4.0, changed=0.9 * 4.0 * PERIOD).verdict is Verdict.ACQUIRING


def test_a_short_run_is_never_lost_by_its_distance() -> None:
    assert history(1e4 + 1e4 * RUN, 0.5).verdict is Verdict.ACQUIRING


def test_a_deputy_that_stopped_answering_is_lost() -> None:
    assert history(np.full(2000, 1.0), 4.0, answered=0.8).verdict is Verdict.LOST


@pytest.mark.parametrize("rate", [-3.0, -0.5, 0.0, 1.0])
def test_trend_of_an_exponential_error_is_its_growth_in_an_orbit(rate: float) -> None:
    orbits = 5.0
    error = np.exp(rate * RUN * orbits)
    # The windows begin within a sample of a whole orbit before the end.
    assert history(error, orbits).trend == pytest.approx(np.exp(rate), rel=abs(rate) * 2.0 * orbits / len(RUN))
