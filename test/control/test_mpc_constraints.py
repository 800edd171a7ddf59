"""MPC constraints: rows, bounds and clip of each, and all of them in one plan."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from formation_gnc.control.mpc import ModelPredictiveController, MpcParameters
from formation_gnc.control.mpc_constraints import (
    KeepOutSpheres,
    PlanInputs,
    ThrustBox,
    ThrustMagnitude,
    ThrustRate,
    TotalThrust,
    circumradius,
    face_normals,
)
from formation_gnc.types import NANOSECONDS

STEPS = 4
UNIT = 0.01
STEP, TICK = 60 * NANOSECONDS, 10 * NANOSECONDS
START = np.array([0.0, 60.0, 1.0, 0.0, 0.0, 0.0])
PARAMETERS = MpcParameters(position_error=(10.0,) * 3, velocity_error=(0.1,) * 3, thrust=(0.002,) * 3)


@pytest.fixture(scope="module")
def inputs(common, vehicle, estimate, target):
    """Inputs of a plan of four steps, 60 m from the chief, with two neighbours and an eclipse."""
    law = ModelPredictiveController(dataclasses.replace(PARAMETERS, horizon=STEPS), common, vehicle)
    neighbours = np.array([[30.0, 40.0, 0.0, 0.0, 0.0, 0.0], [0.0, -500.0, 0.0, 0.0, 0.0, 0.0]])
    aim = target(eclipses=np.array([[70.0, 110.0]]), neighbours=neighbours)
    return PlanInputs(law.qps[0], estimate([0.0, 60.0, 0.0, 0.0, 0.0, 0.0]), aim, np.empty((0, 3)))


def satisfied(constraint, inputs, forces, slacks=()):
    """Whether scaled forces (3 M,) and slacks satisfy a constraint's rows."""
    bounds = constraint.bounds(inputs)
    rows, own = (matrix.toarray() for matrix in constraint.rows())
    if bounds.coefficients is not None:
        rows.T[rows.T != 0.0] = bounds.coefficients
    values = rows @ forces + own @ np.asarray(slacks, dtype=float)
    return bool(((bounds.lower <= values) & (values <= bounds.upper)).all())


@settings(deadline=None)
@given(hnp.arrays(float, 3, elements={"min_value": -2.0, "max_value": 2.0}))
def test_the_total_thrust_polyhedron_lies_inside_the_sphere(point):
    if (np.abs(face_normals() @ point) <= 1.0 / circumradius()).all():
        assert np.linalg.norm(point) <= 1.0 + 1e-12
    assert face_normals().shape == (13, 3)
    assert circumradius() < 1.15  # little conservatism


@settings(deadline=None)
@given(hnp.arrays(float, 3, elements=st.floats(-1.0, 1.0)))
@pytest.mark.covers("Kremmydas 2.1, constraint", "control/mpc_constraints.py")
def test_box_and_polyhedron_bound_the_magnitude_of_the_force(inputs, force):
    total = TotalThrust(0.008, UNIT, 1)
    box = ThrustBox(np.full(3, total.distance), 1, STEP, TICK, off_in_eclipse=False)
    if satisfied(total, inputs, force) and satisfied(box, inputs, force):
        assert np.linalg.norm(UNIT * force) <= 0.008 * (1.0 + 1e-12)
    assert np.linalg.norm(total.clip(UNIT * force, 0, inputs.target)) <= 0.008 * (1.0 + 1e-12)


def test_the_box_is_closed_in_steps_and_ticks_in_eclipse(inputs):
    box = ThrustBox(np.ones(3), STEPS, STEP, TICK, off_in_eclipse=True)
    np.testing.assert_array_equal(box.bounds(inputs).upper.reshape(-1, 3)[:, 0], [1.0, 0.0, 1.0, 1.0])
    force = np.array([0.005, -0.005, 0.005])
    for time, thrust in ((50, True), (60, True), (70, False), (100, False), (110, True)):
        assert box.clip(force, time * NANOSECONDS, inputs.target).any() == thrust


@settings(deadline=None)
@given(
    hnp.arrays(float, (STEPS, 3), elements=st.floats(-1.1, 1.1)),
    hnp.arrays(float, 3, elements=st.floats(-UNIT, UNIT)),
)
def test_the_thrust_rate_bounds_the_change_from_force_to_force(inputs, changes, previous):
    """Changes in units of the limit: a tick's to the first step, a step's between others."""
    rate = ThrustRate(1e-5, UNIT, STEPS, STEP, TICK)
    rate.previous = previous
    limits = np.array([1e-4] + [6e-4] * (STEPS - 1))[:, None]
    forces = previous + np.cumsum(limits * changes, axis=0)
    if np.abs(np.abs(changes) - 1.0).min() > 1e-9:
        assert satisfied(rate, inputs, forces.ravel() / UNIT) == (np.abs(changes) < 1.0).all()
    assert (np.abs(rate.clip(forces[0], 0, inputs.target) - previous) <= 1e-4 * (1.0 + 1e-9)).all()


@settings(deadline=None)
@given(hnp.arrays(float, 3 * STEPS, elements=st.floats(-1.0, 1.0)), st.floats(0.0, 2.0))
def test_the_slack_of_the_absolute_cost_is_above_every_magnitude(inputs, forces, slack):
    epigraph = ThrustMagnitude(STEPS)
    expected = bool((np.abs(forces) <= slack).all())
    assert satisfied(epigraph, inputs, forces, np.full(epigraph.slacks, slack)) == expected


@settings(deadline=None)
@given(hnp.arrays(float, 3 * STEPS, elements=st.floats(-2.0, 2.0)))
def test_a_plan_outside_the_half_spaces_keeps_its_distance(inputs, forces):
    """Without slack: at the end of every step no nearer than the radius to the satellite nearest then."""
    spheres = KeepOutSpheres(35.0, False, STEPS, STEPS, UNIT, 10.0, 1.0)
    if satisfied(spheres, inputs, forces, np.zeros(spheres.slacks)):
        relative = inputs.estimate.relative_state - inputs.target.neighbours
        free = (inputs.qp.free @ relative.T).reshape(STEPS, 6, -1)[:, :3]
        forced = (inputs.qp.forced @ forces).reshape(STEPS, 6)[:, :3]
        distances = np.linalg.norm(free + forced[:, :, None], axis=1)
        nearest = np.linalg.norm(free, axis=1).argmin(axis=1)  # no plan in force
        assert (distances[np.arange(STEPS), nearest] >= 35.0 * (1.0 - 1e-12)).all()


def test_without_other_satellites_no_half_space_is_active(inputs, target):
    alone = dataclasses.replace(inputs, target=target())
    bounds = KeepOutSpheres(20.0, False, STEPS, STEPS, UNIT, 10.0, 1.0).bounds(alone)
    assert np.isneginf(bounds.lower).all()
    assert not bounds.coefficients.any()


def test_a_plan_satisfies_all_constraints_at_once(common, vehicle, estimate, target):
    parameters = dataclasses.replace(
        PARAMETERS,
        horizon=50,
        total_thrust=0.008,
        thrust_rate=1e-5,
        cost="absolute",
        keep_out_radius=20.0,
        off_in_eclipse=True,
    )
    law = ModelPredictiveController(parameters, common, vehicle)
    aim = target(np.array([0.0, -60.0, 0.0, 0.0, 0.0, 0.0]), eclipses=np.array([[900.0, 1500.0]]))
    command = law.command(estimate(START), aim)
    assert not command.fallback
    accuracy = 1e-2 * UNIT  # of the solver, accepted up to a hundred times its tolerance
    plan = law.plan
    assert np.linalg.norm(plan, axis=1).max() <= 0.008 + accuracy
    assert not plan[15:25].any()
    assert np.abs(plan[0]).max() <= 1e-4 + accuracy
    assert np.abs(np.diff(plan, axis=0)).max() <= 6e-4 + accuracy
    states = law.qps[0].free @ START + law.qps[0].forced @ plan.ravel() / 0.008
    closest = np.linalg.norm(states.reshape(-1, 6)[:, :3], axis=1).min()
    assert 19.5 < closest < 20.5  # soft constraint, active
