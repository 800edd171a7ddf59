"""Mass telemetry against the propellant used."""

from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.thrust_tally import ThrustTally
from formation_gnc.types import NANOSECONDS

GAUGE, USED = 0.01, 0.1
"""Allowed difference: a share of the initial mass, and one of the propellant used."""

INITIAL = 0.1
"""Share within which the first mass told may differ from what the parameters say: it is taken for the initial one."""


class Mass(Monitor):
    """Difference of the mass told from the first one told less what the applied force has cost, over the allowance.

    Assumes: a constant specific impulse, telemetry of the applied force, and that the first mass told is true to a
    tenth. Over ticks that were not observed, the mass told is taken within what the thrusters can have burned.
    Cannot see: a leak below a hundredth of the mass.
    Delay: ten ticks for a jump beyond the allowance.
    """

    name = "mass"
    title = "mass told against propellant used"
    test = "bound, 1 % of the initial mass and 10 % of the propellant used"
    when = When.SLOW | When.GAP

    def prepare(self) -> None:
        """The mass at the start of a flight."""
        self._initial = self._start = self.parameters.mass
        self._last, self._is_known = 0, False

    def feed(self, observation: Observation) -> None:
        """Judge, but where it has just been anchored."""
        measurement, thrust = observation.measurement, observation.thrust
        if measurement is None:
            return
        if observation.missed:
            self._anchor(measurement.mass, (observation.time - self._last) / NANOSECONDS, thrust)
        self._last = observation.time
        if not self._is_known and abs(measurement.mass - self._start) <= INITIAL * self._start:
            self._initial = self._start = measurement.mass + thrust.burned
            self._is_known = True
        if not observation.missed:
            expected = self._start - thrust.burned
            allowed = GAUGE * self._initial + USED * max(0.0, self._initial - expected)
            self.judge("", abs(measurement.mass - expected) / allowed, 0.5, 1.0)

    def _anchor(self, mass: float, seconds: float, thrust: ThrustTally) -> None:
        """Take the mass told, within what may have been burned since the last observation."""
        expected = self._start - thrust.burned
        least = max(expected - thrust.largest_rate * seconds, self.parameters.dry_mass)
        if mass == mass:
            self._start = min(max(mass, least), expected) + thrust.burned
