"""Steps that do not resolve the motion, and impacts between the ends of steps."""

import re

import numpy as np
import pytest

from formation_gnc.errors import ImpactError
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.propagation import Propagator

from .conftest import about_perigee, fall

EQUATOR = 6378136.3


def impact(altitude: float, tick: float) -> tuple[float, float, float]:
    """Time (s), longitude (deg) and speed (m/s) at which a circular orbit in dense air ends."""
    propagator = Propagator(tick, forces=Forces(drag=True), bodies=(Body(),))
    time, longitude, state = fall(propagator, EQUATOR + altitude, tick)
    return time, longitude, float(np.linalg.norm(state[3:]))


@pytest.mark.parametrize("altitude", [150e3, 80e3, 22e3])
@pytest.mark.parametrize("tick", [10.0, 60.0])
def test_a_dive_through_dense_air_ends_alike_at_any_tick(altitude: float, tick: float) -> None:
    time, longitude, speed = impact(altitude, tick)
    fine_time, fine_longitude, fine_speed = impact(altitude, 1.0)
    assert time == pytest.approx(fine_time, abs=tick)  # told at the end of a part of a step
    assert longitude == pytest.approx(fine_longitude, abs=0.1 + 0.005 * tick)  # the ground turns by 0.004 deg/s
    assert speed == pytest.approx(fine_speed, rel=0.05)  # falling at its limit


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
