"""Readings that repeat exactly."""

from collections.abc import Sequence

from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.thresholds import repeats, suspicion

RESOLUTION = 1e-3
"""Largest resolution of a sensor, over its noise; so likely is an exact repeat, at most."""


class FrozenReadings(Monitor):
    """Runs of readings of a sensor that are equal to the last bit.

    Assumes: a resolution finer than a thousandth of the noise.
    Cannot see: a frozen sensor that still adds noise; the innovations then drift.
    Delay: as many readings as the threshold.
    """

    name = "frozen_readings"
    title = "readings that repeat exactly"
    test = "length of the run; a repeat has a chance of 1/1000"
    when = When.READINGS

    def prepare(self) -> None:
        """Thresholds for the sensors in use."""
        samples, share = self.parameters.ticks, self.probability / len(self.parameters.sensors)
        self._failed = float(repeats(RESOLUTION, samples, share))
        self._suspect = float(repeats(RESOLUTION, samples, suspicion(share)))
        self._last: dict[str, tuple[int, list[float], int]] = {}

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The sensors."""
        return parameters.sensors

    def feed(self, observation: Observation) -> None:
        """Compare the readings of a tick with those before; one delivered twice counts once."""
        measurement = observation.measurement
        if measurement is None or not measurement.readings:
            return
        for reading in measurement.readings:
            taken = measurement.time - reading.age
            since, values, run = self._last.get(reading.sensor, (-1, [], 0))
            if taken <= since:
                continue
            run = run + 1 if reading.values == values else 0
            self._last[reading.sensor] = taken, reading.values, run
            self.judge(reading.sensor, float(run), self._suspect, self._failed)
