"""Parameters of the navigation filter."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import ModuleParameters
from formation_gnc.navigation.filters import FILTERS
from formation_gnc.navigation.process import PROCESS_MODELS
from formation_gnc.parameters import parameter, with_fields
from formation_gnc.sensors.registry import sensors
from formation_gnc.sensors.sensor import per_value
from formation_gnc.types import NANOSECONDS


def _sigmas() -> Iterator[tuple[str, Any, Any]]:
    for sensor in sensors().values():
        least, greatest = sensor.sigma_range
        doc = f"standard deviation of the {sensor.title} reading"
        follows = f"{{deputy}}.sensors.{sensor.name}.sigma"
        kind, field = sensor.declare(
            sensor.sigma, minimum=least, maximum=greatest, in_flight=True, doc=doc, follows=follows
        )
        yield f"{sensor.name}_sigma", kind, field


@dataclass(frozen=True)
@with_fields(_sigmas())
class NavigationParameters(ModuleParameters):
    """Statistics that the filter assumes, its models, and its limits; `NAME_sigma` for each sensor."""

    filter: str = parameter("ekf", choices=tuple(FILTERS), in_flight=True, doc="extended or unscented Kalman filter")
    process_model: str = parameter(
        "nonlinear_j2",
        choices=tuple(PROCESS_MODELS),
        in_flight=True,
        doc="motion that the filter predicts with",
    )
    acceleration_density: float = parameter(
        1e-14,
        unit="m^2/s^3",
        minimum=0.0,
        maximum=1.0,
        in_flight=True,
        doc="power density of the unmodelled acceleration, each axis",
    )
    sensors: tuple[str, ...] = parameter(
        tuple(name for name, sensor in sensors().items() if sensor.on),
        follows="{deputy}.sensors.*.on",
        in_flight=True,
        doc=f"sensors whose readings are used, of {', '.join(sensors())}",
    )
    pseudo_measurements: bool = parameter(
        False,
        in_flight=True,
        doc="take radius, range rate and latitude as r^2 - r_c^2, r r' and r sin(latitude) (Neokleous 3.13), "
        "when all three are there",
    )
    fix_position_sigma: float = parameter(
        0.5,
        follows="{deputy}.sensors.fix_position_sigma",
        unit="m",
        minimum=1e-6,
        maximum=1e6,
        doc="standard deviation of an acquisition fix, each axis",
    )
    fix_velocity_sigma: float = parameter(
        0.0005,
        follows="{deputy}.sensors.fix_velocity_sigma",
        unit="m/s",
        minimum=1e-9,
        maximum=1e3,
        doc="standard deviation of an acquisition fix, each axis",
    )
    gate: float = parameter(
        5.0,
        minimum=1.0,
        maximum=1e6,
        in_flight=True,
        doc="a reading further from its prediction than so many standard deviations is rejected: chi-square, "
        "one degree of freedom",
    )
    latest: float = parameter(
        60.0,
        unit="s",
        minimum=0.0,
        maximum=3600.0,
        in_flight=True,
        doc="age above which a reading is rejected",
    )
    longest_gap: float = parameter(
        3600.0,
        unit="s",
        above=0.0,
        maximum=1e6,
        in_flight=True,
        doc="time without a measurement beyond which the filter does not predict: it waits for a fix",
    )
    coasting_after: float = parameter(
        60.0,
        unit="s",
        above=0.0,
        in_flight=True,
        doc="time without a reading after which the status says coasting",
    )
    observability_window: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=1e6,
        in_flight=True,
        doc="time over which the unobservable direction is sought; 0 for one orbit",
    )

    @property
    def latest_ticks(self) -> int:
        """Ticks that a reading may be late."""
        return -(-round(self.latest * NANOSECONDS) // self.tick_ns)

    @property
    def sigmas(self) -> dict[str, tuple[float, ...]]:
        """Standard deviation of each value of a reading, by sensor in use, in the registry's order."""
        return {name: per_value(getattr(self, f"{name}_sigma")) for name in sensors() if name in self.sensors}

    def __post_init__(self) -> None:
        """Raise ConfigurationError for sensors that do not exist or stand twice."""
        super().__post_init__()
        if not self.sensors or len(self.sigmas) != len(self.sensors):
            raise ConfigurationError(
                f"parameter sensors: {list(self.sensors)} is not allowed; it must be one or more "
                f"different of {', '.join(sensors())}"
            )
