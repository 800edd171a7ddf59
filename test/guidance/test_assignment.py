"""Assignments against trying every one of them, and what phase and tanks do to them."""

import math
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.assignment import assign, assign_with_phase, fuel_weights, transfer_costs
from formation_gnc.guidance.registry import FORMATIONS

Array = NDArray[np.float64]

RATE = 1.0618e-3
ORBIT = math.tau / RATE

tables = st.tuples(st.integers(1, 4), st.integers(0, 2)).flatmap(
    lambda sizes: arrays(float, (sizes[0], sum(sizes)), elements=st.floats(0.0, 100.0))
)


def places(name: str, phase: float) -> Array:
    """(4, 6) states of the places of a formation at a phase."""
    formation = FORMATIONS[name]
    return np.array(
        [formation(formation.Parameters(), RATE, slot).states(np.array([phase / RATE]))[0] for slot in range(4)]
    )


def by_trying(costs: Array) -> float:
    rows = np.arange(len(costs))
    return min(float(costs[rows, list(each)].sum()) for each in permutations(range(costs.shape[1]), len(costs)))


@given(tables)
def test_no_other_assignment_costs_less(costs: Array) -> None:
    slots = assign(costs)
    assert len(set(slots)) == len(slots)
    assert costs[np.arange(len(slots)), list(slots)].sum() == pytest.approx(by_trying(costs), abs=1e-9)


@given(tables, st.data())
def test_no_other_assignment_costs_less_when_it_is_weighted(costs: Array, data: st.DataObject) -> None:
    weights = data.draw(arrays(float, len(costs), elements=st.floats(0.1, 10.0)))
    weighted = weights[:, None] * costs
    slots = assign(costs, weights)
    assert weighted[np.arange(len(slots)), list(slots)].sum() == pytest.approx(by_trying(weighted), abs=1e-9)


@settings(max_examples=10)
@given(st.floats(0.0, math.tau), st.permutations(range(4)))
def test_a_fleet_that_is_in_formation_is_found_to_be_there(phase: float, order: list[int]) -> None:
    states = places("three_in_plane_one_out", phase)[order]
    found = assign_with_phase(transfer_costs(states, lambda at: places("three_in_plane_one_out", at), ORBIT, RATE))
    # the three in plane look the same a third of a revolution on; xatol of 1e-6 rad at a km, 1e-6 m/s
    assert sum(found.delta_v) < 1e-5
    assert found.slots.index(3) == order.index(3)


@settings(max_examples=10)
@given(st.integers(0, 10_000))
def test_the_free_phase_never_costs_more_than_any_of_a_fine_comb(seed: int) -> None:
    states = np.random.default_rng(seed).normal(0.0, 300.0, (4, 6)) * np.repeat([1.0, RATE], 3)
    costs = transfer_costs(states, lambda at: places("tetrahedral", at), 2.0 * ORBIT, RATE)
    found = assign_with_phase(costs)
    assert costs(found.phase)[np.arange(4), list(found.slots)] == pytest.approx(found.delta_v)
    comb = min(by_trying(costs(float(phase))) for phase in np.linspace(0.0, math.tau, 97))
    assert (
        sum(found.delta_v) <= comb * 1.02
    )  # refined next to the best of 72 only: another valley may be a little lower


def test_who_has_little_left_is_spared() -> None:
    # the sum is least with 1 + 4, but the second has a tenth of the fuel
    costs = np.array([[1.0, 3.0], [2.5, 4.0]])
    assert assign(costs) == (0, 1)
    assert assign(costs, fuel_weights(np.array([1.0, 0.1]))) == (1, 0)
    assert assign(costs, fuel_weights(np.array([7.0, 7.0]))) == (0, 1)


@pytest.mark.parametrize(
    ("costs", "reason"),
    [
        (np.ones((3, 2)), "2 places for 3 satellites"),
        (np.array([[math.nan]]), "finite"),
        (np.array([[-1.0]]), "not negative"),
    ],
)
def test_what_cannot_be_assigned_is_rejected(costs: Array, reason: str) -> None:
    with pytest.raises(ConfigurationError, match=reason):
        assign(costs)


@pytest.mark.parametrize("tanks", [[1.0, 0.0], [math.inf, 1.0], [-1.0]])
def test_an_empty_tank_is_rejected(tanks: list[float]) -> None:
    with pytest.raises(ConfigurationError, match="tanks"):
        fuel_weights(np.array(tanks))
