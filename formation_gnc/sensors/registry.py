"""All sensors by name: a new sensor is one file and one line here.

Schemas and kernels are made from the registry when their modules are imported. A sensor from outside the package
is therefore a plug-in (`formation_gnc.plugins`), or registers before `formation_gnc.plant`, `navigation` or
`sensors.kernels` are imported.
"""

from collections.abc import Mapping
from types import MappingProxyType

from formation_gnc.errors import ConfigurationError
from formation_gnc.plugins import load_plugins
from formation_gnc.sensors.bearing import BEARING
from formation_gnc.sensors.chief_range import CHIEF_RANGE
from formation_gnc.sensors.chief_range_rate import CHIEF_RANGE_RATE
from formation_gnc.sensors.gnss_position import GNSS_POSITION
from formation_gnc.sensors.gnss_velocity import GNSS_VELOCITY
from formation_gnc.sensors.latitude import LATITUDE
from formation_gnc.sensors.radius import RADIUS
from formation_gnc.sensors.range_rate import RANGE_RATE
from formation_gnc.sensors.right_ascension import RIGHT_ASCENSION
from formation_gnc.sensors.sensor import Sensor

_SENSORS: dict[str, Sensor] = {
    "radius": RADIUS,
    "range_rate": RANGE_RATE,
    "latitude": LATITUDE,
    "right_ascension": RIGHT_ASCENSION,
    "chief_range": CHIEF_RANGE,
    "chief_range_rate": CHIEF_RANGE_RATE,
    "bearing": BEARING,
    "gnss_position": GNSS_POSITION,
    "gnss_velocity": GNSS_VELOCITY,
}

_in_use = False


def register(sensor: Sensor) -> None:
    """Add a sensor from outside the package.

    Raises:
        ConfigurationError: its name is taken, or schemas or kernels have been made without it.
    """
    if sensor.name in _SENSORS:
        raise ConfigurationError(f"sensor {sensor.name}: there is one of that name")
    if _in_use:
        raise ConfigurationError(f"sensor {sensor.name}: registered too late; schemas and kernels are made")
    _SENSORS[sensor.name] = sensor


def sensors() -> Mapping[str, Sensor]:
    """All sensors by name, in the order of readings; closes the registry."""
    global _in_use
    _in_use = True
    return MappingProxyType(_SENSORS)


for _, _sensor in load_plugins("sensors", Sensor, _SENSORS):
    register(_sensor)
