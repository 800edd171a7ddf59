"""One simulated day of two satellites: the truth's tick beside Basilisk and heyoka on the same forces."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bench.result import Result, interleaved
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.propagation import Propagator
from verification.independent import Basilisk, Heyoka

Array = NDArray[np.float64]

DAY = 86400.0
EPOCH = 7.9e8
ROUNDS = 3

CHIEF = Elements(EARTH_RADIUS + 425e3, 0.0005, 0.0, 0.3, 0.2, 0.1)
STATES = state_from_elements(CHIEF) + np.array([[0.0] * 6, [100.0] + [0.0] * 5])
BODIES = (Body(), Body())


def timed(work: Callable[[], object]) -> float:
    """Wall time of a piece of work, s."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def ours(forces: Forces) -> Callable[[], float]:
    """A day tick by tick, with a thrust handed over at each, as the plant does."""
    propagator, thrust = Propagator(1.0, 1, forces, BODIES, EPOCH), np.zeros((2, 3))

    def day() -> None:
        states = STATES
        for k in range(int(DAY)):
            states = propagator.propagate(float(k), states, thrust)

    return lambda: timed(day)


def basilisk(forces: Forces, precise: bool) -> Callable[[], float]:
    """A day in steps of 1 s; a new simulation each time, set up off the clock."""

    def measure() -> float:
        simulation = Basilisk(forces, EPOCH, STATES, 1.0, precise=precise, still_sky=True)
        return timed(lambda: simulation.fly(DAY))

    return measure


def heyoka(forces: Forces, ticks: bool) -> Callable[[], float]:
    """A day of each satellite: stopped at every tick, as thrust would need, or in steps of its own."""
    integrator = Heyoka(forces, EPOCH, np.float64)

    def day() -> None:
        for state in STATES:
            if ticks:
                integrator.fly_in_ticks(state, DAY, 1.0)
            else:
                integrator.fly(state, DAY)

    return lambda: timed(day)


def run() -> list[Result]:
    """Seconds of wall time for the simulated day, ours and theirs taken in turn."""
    all_forces = Forces(harmonics_degree=20, sun=True, moon=True, radiation_pressure=True, drag=True)
    cases: list[tuple[str, Forces, Callable[[], float], str]] = [
        ("a day, two satellites, J2: Basilisk, RK4", Forces(), basilisk(Forces(), False), "<= 1"),
        ("a day, two satellites, J2: Basilisk, RKF7(8)", Forces(), basilisk(Forces(), True), "<= 1"),
        ("a day, two satellites, J2: heyoka, ticks of 1 s", Forces(), heyoka(Forces(), True), ""),
        ("a day, two satellites, J2: heyoka, free steps", Forces(), heyoka(Forces(), False), ""),
        ("a day, two satellites, all forces: Basilisk, RK4", all_forces, basilisk(all_forces, False), "<= 1"),
    ]
    results = []
    for name, forces, theirs, goal in cases:
        mine, other = interleaved((ours(forces), theirs), ROUNDS)
        results.append(Result(name, mine, other, "s", mine / other, goal))
    return results
