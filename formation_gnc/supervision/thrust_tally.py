"""Applied against commanded force, tick by tick, and what the thrust has done since the last comparison."""

from math import log

import numpy as np

from formation_gnc.records import Measurement
from formation_gnc.supervision import kernels
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.thresholds import suspicion
from formation_gnc.types import Vector

STANDARD_GRAVITY = 9.80665
"""Defines specific impulse in seconds, m/s^2."""

ALLOWED = 0.02
"""Allowed difference of force and command, over the limit of the axis."""

SCALE = 0.1
"""Allowed difference besides, over the command: scale and mounting."""

NOISE = 0.05
"""Standard deviation of a random difference, over the limit."""

CEILING = 4.0
"""Largest sum of differences, over the threshold."""

_NO_FORCE = np.zeros(3)


class ThrustTally:
    """Sums of what force and command differ by beyond the allowance, propellant burned, and velocity by thrust."""

    def __init__(self, parameters: SupervisorParameters, probability: float) -> None:
        """Without a memory.

        Args:
            parameters: of supervision.
            probability: of a false alarm of any sum in the whole flight.
        """
        self.suspect = _threshold(suspicion(probability), parameters.ticks)
        """Sum that is suspect."""
        self.failed = _threshold(probability, parameters.ticks)
        """Sum that is a failure."""
        coarse = max(parameters.dead_band, parameters.quantum, parameters.minimum_impulse / parameters.tick)
        limits = [each or max(*parameters.thrust_limit, 1e-9) for each in parameters.thrust_limit]
        exhaust = parameters.specific_impulse * STANDARD_GRAVITY
        self.per_impulse = 1.0 / exhaust if exhaust > 0.0 else 0.0
        self.largest_rate = sum(parameters.thrust_limit) * self.per_impulse
        self.memory = np.zeros(kernels.TALLY)
        self.memory[kernels.TURN] = parameters.mean_motion
        settings = np.zeros(kernels.TALLY_SETTINGS)
        settings[kernels.LIMIT : kernels.LIMIT + 3] = limits
        settings[kernels.ALLOWED : kernels.ALLOWED + 3] = [ALLOWED + coarse / each for each in limits]
        settings[kernels.SCALE], settings[kernels.TOTAL] = SCALE, parameters.total_thrust
        settings[kernels.ECLIPSE] = parameters.off_in_eclipse
        settings[kernels.SUSPECT], settings[kernels.CEILING] = self.suspect, CEILING * self.failed
        settings[kernels.PER_IMPULSE], settings[kernels.RATE] = self.per_impulse, self.largest_rate
        self._settings, self._tick = settings, parameters.tick

    def add(self, measurement: Measurement, commanded: Vector | None, in_eclipse: bool, left: int) -> bool:
        """Add the force of the tick that has ended; returns whether a sum is suspect.

        Args:
            measurement: with the force by telemetry.
            commanded: force (3,) for that tick; None where it is not known.
            in_eclipse: whether the tick began in eclipse.
            left: ticks from now to the next comparison.
        """
        return kernels.tally(
            measurement.applied_force,
            _NO_FORCE if commanded is None else commanded,
            commanded is not None,
            in_eclipse,
            measurement.mass,
            self._tick,
            (left + 0.5) * self._tick,
            self.memory,
            self._settings,
        )

    def interrupt(self) -> None:
        """Forget the command of the tick before."""
        self.memory[kernels.KNOWN] = 0.0

    @property
    def sums(self) -> list[float]:
        """Of differences, (3,), over the limit of each axis."""
        sums: list[float] = self.memory[kernels.SUMS : kernels.SUMS + 3].tolist()
        return sums

    @property
    def burned(self) -> float:
        """Propellant burned so far, kg."""
        return float(self.memory[kernels.BURNED])


def _threshold(probability: float, ticks: int) -> float:
    """Sum that any of three axes, to either side, exceeds in a flight with a probability (Lundberg)."""
    return NOISE**2 * log(6.0 * ticks / probability) / (2.0 * ALLOWED)
