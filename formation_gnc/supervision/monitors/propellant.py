"""Propellant against what the rest of the flight will take."""

from math import inf, tau

from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.types import NANOSECONDS


class Propellant(Monitor):
    """Propellant that the rest of the flight takes at the rate of the last revolution in `keep`, over what is left.

    Assumes: telemetry of force and mass, a constant specific impulse; a formation that is kept takes the same in every
    revolution.
    Cannot see: manoeuvres to come, nor a flight without specific impulse.
    Delay: a revolution after the use has changed.
    """

    name = "propellant"
    title = "propellant against the rest of the flight"
    test = "bound, the rate of the last revolution in keep over the time left"
    when = When.RARE

    def prepare(self) -> None:
        """No revolution flown."""
        self._period = round(tau / self.parameters.mean_motion * NANOSECONDS)
        self._start, self._burned = -1, 0.0

    def feed(self, observation: Observation) -> None:
        """Judge whenever a revolution in `keep` is over."""
        measurement, burned = observation.measurement, observation.thrust.burned
        if observation.mode is not Mode.KEEP or observation.missed or measurement is None:
            self._start = -1
        elif self._start < 0:
            self._start, self._burned = observation.time, burned
        elif observation.time - self._start >= self._period:
            rate = (burned - self._burned) / (observation.time - self._start)
            needed = rate * max(0.0, self.parameters.duration * NANOSECONDS - observation.time)
            left = measurement.mass - self.parameters.dry_mass
            self.judge("", needed / left if left > 0.0 else inf if needed > 0.0 else 0.0, 0.75, 1.0)
            self._start, self._burned = observation.time, burned
