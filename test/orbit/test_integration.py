"""Steps that do not resolve the motion, and impacts between the ends of steps."""

import re

import numpy as np
import pytest

from formation_gnc.errors import ImpactError
from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.propagation import Propagator, propagate_with_transition

EQUATOR = 6378136.3


def impact(altitude: float, tick: float) -> tuple[float, float, float]:
    """Time (s), longitude (deg) and speed (m/s) at which a circular orbit in dense air ends."""
    radius = EQUATOR + altitude
    propagator = Propagator(tick, forces=Forces(drag=True), bodies=(Body(),))
    states, time = np.array([[radius, 0.0, 0.0, 0.0, np.sqrt(MU / radius), 0.0]]), 0.0
    message = ""
    while not message:
        try:
            states = propagator.propagate(time, states, np.zeros((1, 3)))
        except ImpactError as error:
            message = str(error)
        assert np.linalg.norm(states[0, :3]) < radius + 10e3
        time += tick
    found = re.search(r"at ([\d.]+) s, latitude .* longitude ([-\d.]+) deg: state (.*)$", message)
    assert found is not None
    speed = np.linalg.norm(np.fromstring(found[3].strip("[]"), sep=",")[3:])
    return float(found[1]), float(found[2]), float(speed)


@pytest.mark.parametrize("altitude", [150e3, 80e3, 22e3])
@pytest.mark.parametrize("tick", [10.0, 60.0])
def test_a_dive_through_dense_air_ends_alike_at_any_tick(altitude: float, tick: float) -> None:
    time, longitude, speed = impact(altitude, tick)
    fine_time, fine_longitude, fine_speed = impact(altitude, 1.0)
    assert time == pytest.approx(fine_time, abs=tick)  # told at the end of a part of a step
    assert longitude == pytest.approx(fine_longitude, abs=0.1 + 0.005 * tick)  # the ground turns by 0.004 deg/s
    assert speed == pytest.approx(fine_speed, rel=0.05)  # falling at its limit


def about_perigee(depth: float, before: float) -> np.ndarray:
    """State (1, 6) a time (s) before an equatorial perigee that lies so deep (m) below the surface."""
    perigee, apogee = EARTH_RADIUS - depth, EARTH_RADIUS + 1000e3
    speed = np.sqrt(2.0 * MU * (1.0 / perigee - 1.0 / (perigee + apogee)))
    state = np.array([perigee, 0.0, 0.0, 0.0, speed, 0.0])
    return propagate_with_transition(state, np.zeros(3), -before, 60)[0][None]


def test_an_impact_between_two_ticks_is_seen() -> None:
    start = about_perigee(80e3, 900.0)
    assert np.linalg.norm(start[0, :3]) > EARTH_RADIUS + 100e3
    with pytest.raises(ImpactError) as raised:
        Propagator(1800.0, substeps=180).propagate(0.0, start, np.zeros((1, 3)))
    found = re.search(r"at ([\d.]+) s", str(raised.value))
    assert found is not None
    assert 0.0 < float(found[1]) < 900.0  # on the way down


@pytest.mark.parametrize(("depth", "falls"), [(100.0, True), (-100.0, False)])
def test_a_perigee_within_one_step_is_seen(depth: float, falls: bool) -> None:
    """A step of a minute, whose ends are 2 km above the perigee; the cubic between is within 20 m of the orbit."""
    start = about_perigee(depth, 30.0)
    assert np.linalg.norm(start[0, :3]) > EARTH_RADIUS + 200.0
    propagator = Propagator(60.0)
    if falls:
        with pytest.raises(ImpactError):
            propagator.propagate(0.0, start, np.zeros((1, 3)))
    else:
        assert np.linalg.norm(propagator.propagate(0.0, start, np.zeros((1, 3)))[0, :3]) > EARTH_RADIUS
