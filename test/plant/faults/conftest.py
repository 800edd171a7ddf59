"""A plant flown with faults, and the same one without."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from formation_gnc.parameters import load
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.plant.plant import Plant
from formation_gnc.records import Event, Measurement, SatelliteTruth
from formation_gnc.types import Vector

VALUES: dict[str, Any] = {
    "chief.semi_major_axis": 6978100.0,
    "chief.eccentricity": 0.01,
    "chief.inclination": 1.48,
    "duration": 6000.0,
    "tick": 1.0,
    "deputies": ["deputy1", "deputy2"],
    "deputy1.relative_state": [10.0, -90.0, 10.0, 0.02, 0.0, -0.01],
    "deputy2.relative_state": [0.0, 50.0, 0.0, 0.0, 0.0, 0.0],
    **{f"deputy1.sensors.{name}.interval": 2.0 for name in ("radius", "range_rate", "latitude")},
}
COMMAND = np.array([0.004, -0.003, 0.002])

Readings = dict[str, dict[int, list[float]]]


@dataclass
class Flight:
    """What a plant gave, tick by tick."""

    plant: Plant
    measurements: dict[str, list[Measurement]] = field(default_factory=dict)
    truths: dict[str, list[SatelliteTruth]] = field(default_factory=dict)
    chief: list[Vector] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def fly(self, ticks: int, command: Vector | Callable[[int], Vector | None]) -> "Flight":
        """Go on for some ticks, with a command to every deputy; None for a miss."""
        for _ in range(ticks):
            for name, measurement in self.plant.measure().items():
                self.measurements.setdefault(name, []).append(measurement)
            truth = self.plant.truth()
            self.chief.append(truth.chief_state)
            for each in truth.deputies:
                self.truths.setdefault(each.name, []).append(each)
            force = command(self.plant.tick) if callable(command) else command
            self.plant.step({} if force is None else dict.fromkeys(self.measurements, force))
            self.events += self.plant.take_events()
        return self

    def readings(self, deputy: str = "deputy1") -> Readings:
        """Values by sensor and by the tick at which they arrive."""
        found: Readings = {}
        for tick, measurement in enumerate(self.measurements[deputy]):
            for reading in measurement.readings:
                assert tick not in found.setdefault(reading.sensor, {}), "two readings of a sensor at once"
                found[reading.sensor][tick] = reading.values
        return found

    def told(self, name: str, deputy: str = "deputy1") -> list[Any]:
        """A field of the measurements."""
        return [getattr(each, name) for each in self.measurements[deputy]]

    def true(self, name: str, deputy: str = "deputy1") -> list[Any]:
        """A field of the truth."""
        return [getattr(each, name) for each in self.truths[deputy]]


type Fly = Callable[..., Flight]


@pytest.fixture
def fly() -> Fly:
    """Flies a plant with `faults`, and other parameters changed."""

    def fly(
        *faults: str,
        ticks: int = 30,
        command: Vector | Callable[[int], Vector | None] = COMMAND,
        values: Mapping[str, Any] | None = None,
    ) -> Flight:
        parameters = load(PlantParameters, VALUES | {"faults": list(faults)} | dict(values or {}))
        return Flight(Plant(parameters)).fly(ticks, command)

    return fly


def differences(faulty: Flight, clean: Flight, sensor: str) -> dict[int, Vector]:
    """Faulty less clean values of a sensor by tick, of readings that both have."""
    one, other = faulty.readings()[sensor], clean.readings()[sensor]
    return {tick: np.subtract(one[tick], other[tick]) for tick in sorted(one.keys() & other.keys())}
