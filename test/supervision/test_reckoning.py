"""Dead reckoning against the truth: the plant's propagator with the same thrust."""

import numpy as np
import pytest

from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import Estimate, EstimateStatus, Measurement
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.supervision.reckoning import DeadReckoner
from formation_gnc.supervision.thrust_tally import ThrustTally
from formation_gnc.types import NANOSECONDS

from .conftest import supervisor_parameters

MASS, LIMIT, RADIUS = 100.0, 0.5, 7.0e6
"""kg, N, m: 5 mm/s^2, so that the thrust of a comparison moves the satellite by tens of metres."""


def drifts(tick: float, rng: np.random.Generator) -> list[list[float]]:
    """Difference of the true state from dead reckoning, in m and m/s, over an orbit of thrust drawn at every tick."""
    scenario = load_scenario("leader_follower", {"/**": {"tick": tick}})
    tally = ThrustTally(supervisor_parameters(scenario), 1e-4)
    tick_ns = round(tick * NANOSECONDS)
    reckoner = DeadReckoner(tick_ns, tally.memory)
    propagator = Propagator(tick, max(1, round(tick / 10.0)), Forces(zonal_degree=2))
    speed = np.sqrt(3.986004415e14 / RADIUS)
    chief = np.array([RADIUS, 0.0, 0.0, 0.0, 0.6 * speed, 0.8 * speed])
    states = np.array([chief, inertial_from_relative(chief, np.array([100.0, 500.0, 50.0, 0.0, -0.2, 0.0]))])
    force, found = np.zeros(3), []
    for number in range(round(5800.0 / tick)):
        relative = relative_from_inertial(states[0], states[1])
        measurement = Measurement(number * tick_ns, "deputy1", states[0], [], force, MASS, False, False, np.zeros(6))
        left = -number % reckoner.ticks
        tally.add(measurement, None, False, left)
        if left == 0:
            status = EstimateStatus.TRACKING
            estimate = Estimate(number * tick_ns, relative, states[0], MASS, np.eye(6), False, [], 0.0, status)
            reckoning = reckoner.compare(measurement, estimate, number > 0)
            if reckoning is not None and reckoning.jump is not None:
                found.append(reckoning.jump)
        if number % 7 == 0:  # thrust that comes late or early in an interval, and reverses
            force = LIMIT * rng.uniform(-1.0, 1.0, 3)
        states = propagator.propagate_with_thrust(
            number * tick, states, np.array([np.zeros(3), force]), np.array([1.0, MASS])
        )
    return found


@pytest.mark.parametrize("tick", [1.0, 10.0, 60.0])
def test_thrust_is_reckoned_as_the_plant_applies_it(tick: float) -> None:
    found = np.array(drifts(tick, np.random.default_rng(1)))
    assert len(found) > 40
    # Deviations are one. What is left goes with the square of the angle of a tick: the curvature within it.
    ticks = min(10, max(1, round(120.0 / tick)))
    allowed = 0.5 * ticks * LIMIT / MASS * tick * (1.08e-3 * tick) ** 2 + 1e-6
    assert np.abs(found[:, 3:]).max() < allowed
    assert np.abs(found[:, :3]).max() < allowed * ticks * tick
