"""Registry of sensors: what a description must be, and what follows from it."""

from dataclasses import replace
from typing import Any

import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.parameters import leaves
from formation_gnc.plant.sensors import SensorSuite
from formation_gnc.sensors.radius import RADIUS
from formation_gnc.sensors.registry import register, sensors
from formation_gnc.sensors.sensor import Sensor

ALL = list(sensors().values())


@pytest.mark.parametrize("sensor", ALL, ids=lambda sensor: sensor.name)
def test_plant_and_filter_have_parameters_of_every_sensor(sensor: Sensor) -> None:
    of_plant = {leaf.name: leaf for leaf in leaves(SensorSuite, {})}
    of_filter = {leaf.name: leaf for leaf in leaves(NavigationParameters, {})}
    sigma = of_filter[f"{sensor.name}_sigma"]
    assert sigma.default == (sensor.sigma[0] if sensor.size == 1 else sensor.sigma)
    assert sigma.limits.unit == of_plant[f"{sensor.name}.sigma"].limits.unit == sensor.unit
    assert (sigma.limits.minimum, sigma.limits.maximum) == sensor.sigma_range
    assert of_plant[f"{sensor.name}.sigma"].default == sigma.default
    assert of_plant[f"{sensor.name}.on"].default == sensor.on


@pytest.mark.parametrize("name", list(sensors()))
def test_the_registry_knows_a_sensor_by_its_own_name(name: str) -> None:
    assert sensors()[name].name == name


def test_the_registry_cannot_be_changed_from_outside() -> None:
    with pytest.raises(TypeError):
        sensors()["sextant"] = RADIUS  # type: ignore[index]


def test_a_taken_name_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="radius: there is one"):
        register(RADIUS)


def test_a_sensor_after_schemas_and_kernels_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="sextant: registered too late"):
        register(replace(RADIUS, name="sextant"))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "star tracker"}, "'star tracker': its name"),
        ({"sigma": (1.0, 2.0)}, "radius: sigma .* must fit its 1 values"),
        ({"angles": (1,)}, "radius: .*angles .* must fit its 1 values"),
    ],
)
def test_a_description_that_contradicts_itself_is_rejected(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        replace(RADIUS, **changes)
