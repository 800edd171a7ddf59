"""Description of a sensor: one object that plant, filter, parameters and plots are made from."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix, Vector

type State = Sequence[float] | Vector
"""Inertial state (6,), m and m/s: a list in Python, an array in kernels."""


@dataclass(frozen=True, slots=True)
class DisplayUnit:
    """Unit of plots, and its factor from the sensor's own unit."""

    name: str
    factor: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """A sensor of a deputy.

    `measure` and `differentiate` are plain functions that Numba can compile: the plant calls them in Python, the
    filter compiled, through `formation_gnc.sensors.kernels`. Each takes the inertial states of deputy and chief,
    (6,), m and m/s. Where the sensor has no direction (above a pole, at the chief), the derivatives are not finite.
    """

    name: str
    """In readings and parameters: `name` of the plant's suite, `name_sigma` of the filter."""
    title: str
    """In plots and documentation."""
    unit: str
    """Of every value of a reading."""
    measure: Callable[[State, State], tuple[float, ...]]
    """Reading without noise, from the states of deputy and chief."""
    differentiate: Callable[[Vector, Vector, Matrix], None]
    """Writes the Jacobian (size, 6) of `measure` with respect to the deputy's state into its third argument, which
    is zero before."""
    sigma: tuple[float, ...]
    """Default standard deviation of the noise of each value."""
    sigma_range: tuple[float, float]
    """Least and greatest standard deviation that the filter accepts."""
    reading_unit: DisplayUnit
    innovation_unit: DisplayUnit
    on: bool = True
    """Whether a deputy has it by default."""
    labels: tuple[str, ...] = ("",)
    """Name of each value of a reading, for plots."""
    angles: tuple[int, ...] = ()
    """Places of values that count modulo a turn."""

    def __post_init__(self) -> None:
        """Raise ConfigurationError for a description that contradicts itself."""
        if not (self.name.isidentifier() and self.name.isascii()):
            raise ConfigurationError(f"sensor {self.name!r}: its name must have letters, digits and _ only")
        if len(self.sigma) != self.size or not set(self.angles) <= set(range(self.size)):
            raise ConfigurationError(
                f"sensor {self.name}: sigma {self.sigma} and angles {self.angles} must fit its {self.size} values"
            )

    @property
    def size(self) -> int:
        """Number of values of a reading."""
        return len(self.labels)

    def declare(self, default: Sequence[float], **limits: Any) -> tuple[Any, Any]:
        """Type and field of a parameter with one number for each value of a reading."""
        if self.size == 1:
            return float, parameter(default[0], unit=self.unit, **limits)
        return tuple[float, ...], parameter(tuple(default), unit=self.unit, length=self.size, **limits)


def per_value(value: float | Sequence[float]) -> tuple[float, ...]:
    """Value of a parameter made by `Sensor.declare`, as one number for each value of a reading."""
    return (value,) if isinstance(value, int | float) else tuple(value)
