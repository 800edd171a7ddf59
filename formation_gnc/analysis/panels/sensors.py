"""Sensors of a history: order, colours, units and words."""

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.plot import COLOURS
from formation_gnc.analysis.sensor_series import Channel
from formation_gnc.sensors.registry import sensors
from formation_gnc.sensors.sensor import DisplayUnit
from formation_gnc.types import Matrix

_NO_UNIT = DisplayUnit("")


def title(name: str) -> str:
    """Title of a sensor; its name for one that is not registered."""
    sensor = sensors().get(name)
    return sensor.title if sensor else name.replace("_", " ")


def reading_unit(name: str) -> DisplayUnit:
    """Unit of a sensor's readings in plots; none for one that is not registered."""
    sensor = sensors().get(name)
    return sensor.reading_unit if sensor else _NO_UNIT


def innovation_unit(name: str) -> DisplayUnit:
    """Unit of a sensor's innovations in plots; none for one that is not registered."""
    sensor = sensors().get(name)
    return sensor.innovation_unit if sensor else _NO_UNIT


def sensor_colours(deputy: DeputyHistory) -> dict[str, str]:
    """Colour of each sensor that has readings or innovations."""
    sensors = dict.fromkeys(sensor for sensor, _ in (*deputy.readings, *deputy.innovations))
    return {sensor: COLOURS[number % len(COLOURS)] for number, sensor in enumerate(sensors)}


def components(series: dict[Channel, Matrix], name: str) -> dict[str, Matrix]:
    """Rows of a sensor by label: its title, with the label or number of each value of its readings."""
    sensor = sensors().get(name)
    own = {component: rows for (each, component), rows in series.items() if each == name}
    labels = sensor.labels if sensor else ("",) if len(own) == 1 else ()
    words = {component: labels[component] if component < len(labels) else str(component + 1) for component in own}
    return {f"{title(name)} {words[component]}".rstrip(): rows for component, rows in own.items()}
