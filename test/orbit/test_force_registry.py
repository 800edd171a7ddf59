"""Registry of forces, and the acceleration at a state."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.forces import drag, harmonics, radiation, third_body
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.gravity import acceleration as point_mass_with_j2
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.orbit.sky import earth_rotation_angle, moon, sun
from formation_gnc.parameters import load
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.plant.plant import Plant

ELEMENTS = Elements(6.8e6, 0.01, 0.9, 0.3, 0.4, 0.5)
EPOCH = 7.9e8
ALL = Forces(harmonics_degree=8, sun=True, moon=True, radiation_pressure=True, drag=True)

# One file.
ALONG_TRACK = '''
"""Constant acceleration along the velocity."""

from math import sqrt

from formation_gnc.orbit.forces.force import Floats, Force, Vector3
from formation_gnc.orbit.jit import inline
from formation_gnc.parameters import parameter


@inline
def acceleration(settings: Floats, coefficient: float, ephemerides: Floats, state: Floats) -> Vector3:
    _, _, _, vx, vy, vz = state
    scale = settings[0] / sqrt(vx * vx + vy * vy + vz * vz)
    return scale * vx, scale * vy, scale * vz


ALONG_TRACK = Force({"along_track": parameter(0.0, unit="m/s^2", doc="along the velocity")}, acceleration)
'''

# One line, then a run of the plant without and with the force.
FLIGHTS = """
import json
from formation_gnc.orbit.forces import registry
from along_track import ALONG_TRACK
registry.FORCES.append(ALONG_TRACK)

from test_force_registry import run_plant
print(json.dumps([run_plant(), run_plant({"forces.along_track": 1e-4})]))
"""


def run_plant(values: dict[str, Any] | None = None) -> list[float]:
    """Inertial state of the chief after ten minutes without thrust."""
    given = {
        "chief.semi_major_axis": 7e6,
        "tick": 10.0,
        "duration": 600.0,
        "forces.zonal_degree": 0,
        "deputy1.relative_state": [0.0, -100.0, 0.0, 0.0, 0.0, 0.0],
    } | (values or {})
    plant = Plant(load(PlantParameters, given))
    while not plant.finished:
        plant.measure()
        plant.step({"deputy1": np.zeros(3)})
    return plant.truth().chief_state.tolist()


@pytest.mark.thorough
def test_new_force_is_one_file_and_one_line(tmp_path):
    (tmp_path / "along_track.py").write_text(ALONG_TRACK)
    (tmp_path / "flights.py").write_text(FLIGHTS)
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    run = [sys.executable, str(tmp_path / "flights.py")]
    output = subprocess.run(run, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=True)
    off, on = json.loads(output.stdout)
    assert off == run_plant()  # to the bit
    axes = [1.0 / (2.0 / np.linalg.norm(s[:3]) - np.dot(s[3:], s[3:]) / MU) for s in (off, on)]
    # da/dt = 2 f / n on a circular orbit; n changes by 2e-5 over the rise of 110 m.
    assert axes[1] - axes[0] == pytest.approx(2.0 * 1e-4 * 600.0 / np.sqrt(MU / 7e6**3), rel=1e-4)


def test_acceleration_by_default_is_point_mass_and_j2():
    states = state_from_elements(ELEMENTS)[None]
    assert np.array_equal(Propagator(1.0).acceleration(0.0, states)[0], point_mass_with_j2(states[0]))


@pytest.mark.thorough
def test_acceleration_is_the_sum_of_the_forces_over_the_mass():
    state, body, angle = state_from_elements(ELEMENTS), Body(50.0, 2.0, 2.1, 1.4), earth_rotation_angle(EPOCH + 60.0)
    x, y, z, vx, vy, vz = state
    parts = [
        harmonics.acceleration(8, np.cos(angle), np.sin(angle), x, y, z),
        third_body.acceleration(third_body.MU_SUN, *sun(EPOCH + 60.0), x, y, z),
        third_body.acceleration(third_body.MU_MOON, *moon(EPOCH + 60.0), x, y, z),
        radiation.acceleration(2.0 * 1.4 / 40.0, *sun(EPOCH + 60.0), x, y, z),
        drag.acceleration(2.0 * 2.1 / 40.0, x, y, z, vx, vy, vz),
    ]
    propagator = Propagator(1.0, 1, ALL, [body, body], EPOCH)
    together = propagator.acceleration(60.0, np.array([state, state]), np.array([40.0, 80.0]))
    assert together[0] == pytest.approx(np.sum(parts, axis=0), rel=1e-15)
    surface = np.array(parts[3]) + np.array(parts[4])
    # Rounding of the sum, 9 m/s^2.
    assert together[0] - together[1] == pytest.approx(0.5 * surface, abs=1e-14)


def test_acceleration_is_the_derivative_of_the_propagated_velocity():
    states, body = state_from_elements(ELEMENTS)[None], Body()
    propagator = Propagator(1.0, 1, ALL, [body], EPOCH)
    after = propagator.propagate(0.0, states, np.zeros((1, 3)))
    middle = Propagator(0.5, 1, ALL, [body], EPOCH).propagate(0.0, states, np.zeros((1, 3)))
    begin, half, end = (propagator.acceleration(t, s) for t, s in ((0.0, states), (0.5, middle), (1.0, after)))
    change = after[0, 3:] - states[0, 3:]
    # Simpson's rule over a second is exact to 1e-17 of the acceleration; velocities round at 1e-12 m/s.
    assert change == pytest.approx((begin + 4.0 * half + end)[0] / 6.0, abs=5e-12)


@pytest.mark.thorough
def test_forces_with_the_same_parameter_name_are_rejected(tmp_path):
    script = """
from formation_gnc.orbit.forces import registry
registry.FORCES.append(registry.FORCES[0])
import formation_gnc.orbit.forces.model
"""
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert "parameter sun of a force: another one has this name" in result.stderr
