"""Readings and innovations of a recorded run by sensor."""

from itertools import count, takewhile
from typing import Self

import numpy as np

from formation_gnc.analysis.thinning import ThinnedByKey
from formation_gnc.recording.reader import Fields
from formation_gnc.types import Matrix

HOUR = 3600.0

Channel = tuple[str, int]
"""Name of a sensor and component of its reading."""


class SensorSeries:
    """Time (h) and values, by sensor and component, thinned while they are read."""

    def __init__(self, elements: str, *fields: str) -> None:
        """Collect these fields, each with a value per component, of the elements of a list in the messages."""
        self._elements, self._fields = elements, fields
        self._series = ThinnedByKey[Channel](1 + len(fields))

    @classmethod
    def of_readings(cls) -> Self:
        """Rows of time and value, from measurements."""
        return cls("readings", "values")

    @classmethod
    def of_innovations(cls) -> Self:
        """Rows of time, value and standard deviation of readings that were used, from estimates."""
        return cls("innovations", "values", "standard_deviations")

    @property
    def rows(self) -> dict[Channel, Matrix]:
        """Rows by sensor and component, in the order in which they occurred."""
        return self._series.rows

    def add(self, batch: Fields) -> None:
        """Take the next batch of messages."""
        found: dict[Channel, list[list[float]]] = {}
        places = (f"{self._elements}.{place}" for place in count())
        for place in takewhile(lambda place: f"{place}.sensor" in batch, places):
            rejections = batch.get(f"{place}.rejection")
            for row, sensor in enumerate(batch[f"{place}.sensor"]):
                if sensor is None or (rejections is not None and rejections[row]):
                    continue
                time = float(batch["time"][row]) / HOUR
                values = zip(*(batch[f"{place}.{field}"][row] for field in self._fields), strict=False)
                for component, each in enumerate(values):
                    found.setdefault((str(sensor), component), []).append([time, *map(float, each)])
        for channel, rows in found.items():
            self._series.add(channel, np.array(sorted(rows)))
