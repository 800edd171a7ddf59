"""Limits of the MPC together: none contradicts another, whatever their sizes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.mpc import ModelPredictiveController, MpcParameters
from formation_gnc.control.mpc_constraints import LEFT
from formation_gnc.relative.hill import HillModel

TICK, TICKS = 20.0, 100
COMMON = CommonParameters(Orbit(6978100.0), tick=TICK)


@st.composite
def limits(draw):
    """Parameters of limits, a box, eclipses (K, 2) in s, and a start."""
    size = 10.0 ** draw(st.floats(-3.0, -1.0))
    eclipses, begin = [], 0.0
    for _ in range(draw(st.integers(0, 2))):
        begin += float(draw(st.integers(0, 1500)))
        eclipses.append((begin, begin := begin + float(draw(st.integers(5, 2000)))))
    parameters = MpcParameters(
        step=draw(st.sampled_from([20.0, 60.0])),
        horizon=110,
        control_horizon=draw(st.sampled_from([0, 109])),
        position_error=(10.0 ** draw(st.floats(0.0, 1.5)),) * 3,
        velocity_error=(0.1,) * 3,
        thrust=(0.2 * size,) * 3,
        thrust_rate=size / 100.0 * 10.0 ** draw(st.floats(-2.0, 0.0)),
        total_thrust=draw(st.sampled_from([0.0, 0.5, 1.5])) * size,
        off_in_eclipse=draw(st.booleans()),
        cost=draw(st.sampled_from(["quadratic", "quadratic", "absolute"])),
    )
    box = size * np.array([1.0, draw(st.floats(0.3, 1.0)), draw(st.sampled_from([0.0, 0.5, 1.0]))])
    start = draw(st.tuples(*[st.floats(-60.0, 60.0)] * 3, *[st.floats(-0.05, 0.05)] * 3))
    return parameters, box, np.array(eclipses).reshape(-1, 2), np.array(start)


@settings(max_examples=2, deadline=None)  # a flight each, of ten seconds or more
@given(limits())
@pytest.mark.thorough
def test_limits_of_any_size_leave_a_plan_in_every_tick(estimate, target, case):
    parameters, box, eclipses, state = case
    law = ModelPredictiveController(parameters, COMMON, Vehicle(100.0, box))
    phi, gamma = HillModel(COMMON.mean_motion).discretise(0.0, TICK)
    change, before, unit = parameters.thrust_rate * TICK, np.zeros(3), box.max()
    windows = eclipses if parameters.off_in_eclipse else np.empty((0, 2))
    for tick in range(TICKS):
        time = TICK * tick
        command = law.command(estimate(state, time), target(time=time, eclipses=eclipses))
        force = command.force
        assert command.fallback == ""
        assert (np.abs(force) <= box * (1.0 + 1e-9)).all()
        if parameters.total_thrust:
            assert np.linalg.norm(force) <= parameters.total_thrust * (1.0 + 1e-9)
        dark = bool(((time < windows[:, 1]) & (time + TICK > windows[:, 0])).any())
        if dark:
            assert not force.any()
        # What the solver's accuracy leaves is cut at the eclipse; the limit on the magnitude goes first.
        assert np.abs(force - before).max() <= change * (1.0 + 1e-3) + (LEFT * unit if dark else 2e-3 * unit)
        before = force
        state = phi @ state + gamma @ np.clip(force, -box, box) / 100.0
