"""Readings and innovations of a recorded run by sensor."""

from typing import Self

import numpy as np

from formation_gnc.analysis.thinning import ThinnedByKey
from formation_gnc.recording.reader import Fields
from formation_gnc.records import Sensor
from formation_gnc.types import Matrix

HOUR = 3600.0

Channel = tuple[str, int]
"""Name of a sensor and component of its reading."""


class SensorSeries:
    """Time (h) and values, by sensor and component, thinned while they are read."""

    def __init__(self, *fields: str) -> None:
        """Collect these fields of the messages, each a list with an element per sensor."""
        self._fields = fields
        self._series = ThinnedByKey[Channel](1 + len(fields))

    @classmethod
    def of_readings(cls) -> Self:
        """Rows of time and value, from measurements."""
        return cls("reading")

    @classmethod
    def of_innovations(cls) -> Self:
        """Rows of time, value and standard deviation, from estimates."""
        return cls("innovation", "innovation_sigma")

    @property
    def rows(self) -> dict[Channel, Matrix]:
        """Rows by sensor and component, in the order in which they occurred."""
        return self._series.rows

    def add(self, batch: Fields) -> None:
        """Take the next batch of messages."""
        found: dict[Channel, list[list[float]]] = {}
        for row in np.flatnonzero([len(sensors) > 0 for sensors in batch["sensor"]]):
            time = float(batch["time"][row]) / HOUR
            values = [batch[name][row] for name in self._fields]
            for place, sensor in enumerate(batch["sensor"][row]):
                if all(place < len(each) for each in values):
                    rows = found.setdefault((_name(int(sensor)), 0), [])
                    rows.append([time, *(float(each[place]) for each in values)])
        for channel, channel_rows in found.items():
            self._series.add(channel, np.array(channel_rows))


def _name(number: int) -> str:
    return Sensor(number).name.lower() if number in list(Sensor) else f"sensor {number}"
