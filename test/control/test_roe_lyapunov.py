"""The Lyapunov law of the relative elements: what never grows, where it thrusts, and what it takes."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.errors import DesignError
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.parameters import load
from formation_gnc.records import NO_ECLIPSES
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.relative_elements import near_circular_elements, near_circular_matrix

ORBIT = Elements(6978100.0, 0.0, 1.48, 0.0, 0.0, 0.0)
CHIEF, N = state_from_elements(ORBIT), ORBIT.mean_motion
MASS, TICK = 4.0, 120.0
FORCE = 8e-6
"""N; one nozzle of NetSat."""


def manager(**values: Any) -> ControllerManager:
    given = {name.replace("__", "."): value for name, value in values.items()}
    common = {"chief.semi_major_axis": 6978100.0, "chief.inclination": 1.48, "tick": TICK, "mass": MASS}
    basis = {"algorithm": "roe_lyapunov", "thrust_limit": (FORCE,) * 3}
    return ControllerManager("c", load(ControllerParameters, common | basis | given))


def fly(law, elements, revolutions, estimate, target, eclipses=NO_ECLIPSES):
    """Elements (K, 6) counted from the start's place, and accelerations (K, 3), tick by tick under Hill's equations."""
    model, state = HillModel(N), near_circular_matrix(0.0, N) @ np.array(elements)
    found, pushes = [], []
    for time in np.arange(0.0, revolutions * ORBIT.period, TICK):
        found.append(near_circular_elements(N * time, N, state))
        thrust, status = law.on_tick(estimate(state, time, MASS, CHIEF), target(time=time, eclipses=eclipses))
        assert not status.fallback
        pushes.append(thrust.force / MASS)
        state = model.propagate(0.0, state, TICK, thrust.force / MASS)
    return np.array(found), np.array(pushes)


vectors = st.tuples(*[st.floats(-50.0, 50.0)] * 4)


@given(vector=vectors, window=st.integers(0, 20))
def test_the_lyapunov_function_never_grows(vector, window, estimate, target):
    """With the governor at rest: dlambda has no error, and the time for one is long."""
    law = manager(roe_lyapunov__window=window, roe_lyapunov__settling=1e9)
    found, _ = fly(law, [0.0, 0.0, *vector], 1.0, estimate, target)
    energy = (found[:, [0, 2, 3, 4, 5]] ** 2).sum(axis=1)
    # Thrust held over a tick, in which the place turns by n T, is at most on the wrong side for that part of it.
    held = 2.0 * np.sqrt(energy[:-1]) * (2.0 * FORCE / MASS * TICK / N) * (N * TICK)
    assert (np.diff(energy) <= held + 1e-9).all()


def test_all_elements_converge_with_low_thrust(estimate, target):
    law = manager(roe_lyapunov__settling=15.0)
    start = np.array([0.0, 60.0, 20.0, -30.0, 15.0, 10.0])
    found, pushes = fly(law, start, 45.0, estimate, target)
    assert np.abs(found[-1]).max() < 1.0
    spent = np.abs(pushes).sum() * TICK
    least = N * (0.5 * math.hypot(20.0, 30.0) + math.hypot(15.0, 10.0))
    assert spent < 2.0 * least


def test_narrow_windows_are_cheaper(estimate, target):
    spent = []
    for window in (0, 14):
        law = manager(roe_lyapunov__window=window, roe_lyapunov__settling=1e9)
        _, pushes = fly(law, [0.0, 0.0, 0.0, 20.0, 0.0, 20.0], 20.0, estimate, target)
        spent.append(np.abs(pushes).sum())
    assert spent[1] < 0.8 * spent[0]


def test_no_thrust_in_eclipse(estimate, target):
    dark = np.array([[1000.0, 2000.0], [4000.0, 4030.0]])
    elements = [5.0, 0.0, 20.0, 20.0, 20.0, 20.0]
    law = manager(roe_lyapunov__off_in_eclipse=True, roe_lyapunov__window=0)
    _, pushes = fly(law, elements, 1.0, estimate, target, dark)
    begin = TICK * np.arange(len(pushes))
    is_dark = ((begin[:, None] < dark[:, 1]) & (begin[:, None] + TICK > dark[:, 0])).any(axis=1)
    assert is_dark.sum() >= 9
    assert not pushes[is_dark].any()
    assert pushes[~is_dark].any(axis=1).all()


def test_along_track_only_leaves_the_plane_alone(estimate, target):
    law = manager(roe_lyapunov__along_track_only=True)
    found, pushes = fly(law, [0.0, 0.0, 10.0, 10.0, 10.0, 5.0], 30.0, estimate, target)
    assert not pushes[:, 2].any()
    np.testing.assert_allclose(found[-1, 4:], [10.0, 5.0], atol=1e-6)
    assert np.abs(found[-1, :4]).max() < 0.5


def test_an_eccentric_chief_is_rejected_by_name():
    with pytest.raises(DesignError, match=r"roe_lyapunov: chief.eccentricity is 0.1; it must be below 0.02"):
        manager(chief__eccentricity=0.1, chief__semi_major_axis=1e7)
