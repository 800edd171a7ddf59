"""Mass telemetry against the propellant used."""

from math import hypot

from formation_gnc.supervision.monitor import Monitor, Observation, When

STANDARD_GRAVITY = 9.80665
"""Defines specific impulse in seconds, m/s^2."""

GAUGE, USED = 0.01, 0.1
"""Allowed difference: a share of the initial mass, and one of the propellant used."""


class Mass(Monitor):
    """Difference of the mass told from the initial mass less what the applied force has cost, over the allowance.

    Assumes: a constant specific impulse, and telemetry of the applied force. Over ticks that were not observed, the
    mass told is taken within what the thrusters can have burned.
    Cannot see: a leak below a hundredth of the mass.
    Delay: ten ticks for a jump beyond the allowance.
    """

    name = "mass"
    title = "mass told against propellant used"
    test = "bound, 1 % of the initial mass and 10 % of the propellant used"
    when = When.ALWAYS

    def prepare(self) -> None:
        """The mass at the start of a flight."""
        parameters = self.parameters
        exhaust = parameters.specific_impulse * STANDARD_GRAVITY
        self._per_impulse = 1.0 / exhaust if exhaust > 0.0 else 0.0
        self._largest_rate = sum(parameters.thrust_limit) * self._per_impulse
        self._expected, self._last = parameters.mass, 0.0

    def feed(self, observation: Observation) -> None:
        """Add the impulse of the tick that has ended, and judge at slow ticks."""
        applied = observation.applied
        if self._per_impulse and applied is not None and not observation.missed and any(applied):
            force = hypot(*applied) if self.parameters.total_thrust else sum(map(abs, applied))
            burned = min(force * self._per_impulse, self._largest_rate) * observation.seconds
            if burned == burned:
                self._expected -= burned
        measurement = observation.measurement
        if measurement is None:
            return
        if observation.missed:
            self._anchor(measurement.mass, observation.time * 1e-9)
        self._last = observation.time * 1e-9
        if observation.slow:
            used = self.parameters.mass - self._expected
            allowed = GAUGE * self.parameters.mass + USED * max(0.0, used)
            self.judge("", abs(measurement.mass - self._expected) / allowed, 0.5, 1.0)

    def _anchor(self, mass: float, seconds: float) -> None:
        """Take the mass told, within what may have been burned since the last observation."""
        least = max(self._expected - self._largest_rate * (seconds - self._last), self.parameters.dry_mass)
        if mass == mass:
            self._expected = min(max(mass, least), self._expected)
