"""Sensors of a history: order, colours, units and words."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.plot import COLOURS
from formation_gnc.analysis.sensor_series import Channel
from formation_gnc.types import Matrix


@dataclass(frozen=True)
class SensorWords:
    """Unit and scale in which readings and innovations of a sensor are shown."""

    unit: str
    scale: float
    innovation_unit: str
    innovation_scale: float


_DEGREES = SensorWords("deg", 180.0 / np.pi, "µrad", 1e6)
_WORDS = {
    "radius": SensorWords("km", 1e-3, "m", 1.0),
    "range_rate": SensorWords("m/s", 1.0, "m/s", 1.0),
    "latitude": _DEGREES,
    "right_ascension": _DEGREES,
    "chief_range": SensorWords("m", 1.0, "m", 1.0),
}


def sensor_words(sensor: str) -> SensorWords:
    """Words for a sensor; without unit for one that is not known."""
    return _WORDS.get(sensor, SensorWords("", 1.0, "", 1.0))


def sensor_colours(deputy: DeputyHistory) -> dict[str, str]:
    """Colour of each sensor that has readings or innovations."""
    sensors = dict.fromkeys(sensor for sensor, _ in (*deputy.readings, *deputy.innovations))
    return {sensor: COLOURS[number % len(COLOURS)] for number, sensor in enumerate(sensors)}


def components(series: dict[Channel, Matrix], sensor: str) -> dict[str, Matrix]:
    """Rows of a sensor by label: its name, numbered where a reading has several components."""
    own = {component: rows for (name, component), rows in series.items() if name == sensor}
    name = sensor.replace("_", " ")
    return {name if len(own) == 1 else f"{name} {component + 1}": rows for component, rows in own.items()}
