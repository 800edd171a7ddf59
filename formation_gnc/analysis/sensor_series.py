"""Readings and innovations of a recorded run by sensor."""

from typing import Self

import numpy as np
from numpy.typing import NDArray

from formation_gnc.analysis.thinning import ThinnedByKey
from formation_gnc.recording.fields import Fields
from formation_gnc.types import Matrix

HOUR = 3600.0

Channel = tuple[str, int]
"""Name of a sensor and component of its reading."""


class SensorSeries:
    """Time (h) and values, by sensor and component, thinned while they are read."""

    def __init__(self, points: int, elements: str, *fields: str) -> None:
        """Collect these fields, each with a value per component, of the elements of a list in the messages."""
        self._elements, self._fields = elements, fields
        self._series = ThinnedByKey[Channel](1 + len(fields), points)

    @classmethod
    def of_readings(cls, points: int) -> Self:
        """Rows of time and value, from measurements."""
        return cls(points, "readings", "values")

    @classmethod
    def of_innovations(cls, points: int) -> Self:
        """Rows of time, value and standard deviation of readings that were used, from estimates."""
        return cls(points, "innovations", "values", "standard_deviations")

    @property
    def rows(self) -> dict[Channel, Matrix]:
        """Rows by sensor and component, in the order in which they occurred."""
        return self._series.rows

    def add(self, batch: Fields) -> None:
        """Take the next batch of messages."""
        found: dict[Channel, list[list[float]]] = {}
        for element in batch.elements(self._elements):
            sensors, times = batch[f"{element}.sensor"], batch["time"] / HOUR
            columns = [batch[f"{element}.{field}"] for field in self._fields]
            for row in np.flatnonzero(self._is_shown(batch, element)):
                values = zip(*(column[row] for column in columns), strict=False)
                for component, each in enumerate(values):
                    found.setdefault((str(sensors[row]), component), []).append([times[row], *each])
        for channel, rows in found.items():
            self._series.add(channel, np.array(sorted(rows)))

    def _is_shown(self, batch: Fields, element: str) -> NDArray[np.bool_]:
        """Rows that have an element of the list, and for innovations use its reading."""
        if f"{element}.rejection" in batch:
            used: NDArray[np.bool_] = batch[f"{element}.rejection"] == ""
            return used
        return np.array([sensor is not None for sensor in batch[f"{element}.sensor"]])
