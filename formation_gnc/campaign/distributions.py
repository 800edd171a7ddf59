"""Distributions of a campaign's dispersions, one class each: a new one is a class and a line in `DISTRIBUTIONS`."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from math import exp, inf, log
from typing import Any, ClassVar

import numpy as np
from scipy.special import ndtr, ndtri

from formation_gnc.errors import ConfigurationError, nearest
from formation_gnc.types import Vector

LEAST = 2.0**-53
"""Least probability drawn; the greatest is 1 less it. So a normal draw is within 8.3 standard deviations."""

WITHIN = "within"
"""Key beside a distribution with the bounds that truncate it."""

STATE = ("x", "y", "z", "vx", "vy", "vz")
"""Components of a relative state, Hill frame."""


def uniforms(random: np.random.Generator, count: int) -> Vector:
    """(count,) numbers in [LEAST, 1 - LEAST], equally distributed."""
    return np.asarray(random.random(count) * (1.0 - 2.0 * LEAST) + LEAST)


class Distribution(ABC):
    """Distribution of a value, or of each value of a list."""

    keys: ClassVar[tuple[str, ...]]
    """Its numbers, in the file."""

    def __init__(self, **numbers: float) -> None:
        """Hold the numbers; raises ConfigurationError for those that are no distribution."""
        for name, value in numbers.items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ConfigurationError(f"{name}: {value!r} is not allowed; it must be a number")
        self.numbers = {name: float(value) for name, value in numbers.items()}
        self.check()

    def check(self) -> None:  # noqa: B027 - optional
        """Raise ConfigurationError for numbers that contradict one another."""

    def draw(self, random: np.random.Generator, size: int) -> list[Any]:
        """Draw `size` values."""
        return [self.quantile(probability) for probability in uniforms(random, size).tolist()]

    def support(self) -> list[Any]:
        """Values that enclose all that is drawn: least and greatest, or all of them."""
        return [self.quantile(LEAST), self.quantile(1.0 - LEAST)]

    @abstractmethod
    def quantile(self, probability: float) -> Any:
        """Value below which draws are with a probability."""

    def probability(self, value: float) -> float:
        """Of a draw below a value."""
        raise NotImplementedError

    def _require_positive(self, name: str) -> None:
        if not self.numbers[name] > 0.0:
            raise ConfigurationError(f"{name}: {self.numbers[name]!r} is not allowed; it must be above 0")


class Normal(Distribution):
    """Normal distribution."""

    keys = ("mean", "sigma")

    def check(self) -> None:
        """A standard deviation above zero."""
        self._require_positive("sigma")

    def quantile(self, probability: float) -> float:
        """By the inverse of the error function."""
        return self.numbers["mean"] + self.numbers["sigma"] * float(ndtri(probability))

    def probability(self, value: float) -> float:
        """By the error function."""
        return float(ndtr((value - self.numbers["mean"]) / self.numbers["sigma"]))


class LogNormal(Distribution):
    """Log-normal distribution: its median, and the standard deviation of the natural logarithm."""

    keys = ("median", "sigma")

    def check(self) -> None:
        """Both above zero."""
        self._require_positive("median")
        self._require_positive("sigma")

    def quantile(self, probability: float) -> float:
        """By the normal's."""
        return self.numbers["median"] * exp(self.numbers["sigma"] * float(ndtri(probability)))

    def probability(self, value: float) -> float:
        """By the normal's."""
        if value <= 0.0:
            return 0.0
        return float(ndtr(log(value / self.numbers["median"]) / self.numbers["sigma"]))


class Uniform(Distribution):
    """Uniform distribution."""

    keys = ("low", "high")

    def check(self) -> None:
        """An interval."""
        if not self.numbers["low"] < self.numbers["high"]:
            raise ConfigurationError(
                f"high: {self.numbers['high']!r} is not allowed; it must be above low, {self.numbers['low']!r}"
            )

    def quantile(self, probability: float) -> float:
        """Linear."""
        low, high = self.numbers["low"], self.numbers["high"]
        return min(max(low + probability * (high - low), low), high)

    def probability(self, value: float) -> float:
        """Linear."""
        low, high = self.numbers["low"], self.numbers["high"]
        return min(max((value - low) / (high - low), 0.0), 1.0)


class Choice(Distribution):
    """One of several values, equally likely or by weight."""

    keys = ("of", "weights")

    def __init__(self, of: Sequence[Any], weights: Sequence[float] | None = None) -> None:
        """Hold the values."""
        if not isinstance(of, list | tuple) or len(of) < 2:
            raise ConfigurationError(f"of: {of!r} is not allowed; it must be a list of two values or more")
        weights = [1.0] * len(of) if weights is None else weights
        good = isinstance(weights, list | tuple) and all(isinstance(each, int | float) and each > 0 for each in weights)
        if not good or len(weights) != len(of):
            raise ConfigurationError(f"weights: {weights!r} is not allowed; it must be {len(of)} numbers above 0")
        self._values = list(of)
        self._until = np.cumsum(weights) / np.sum(weights)

    def quantile(self, probability: float) -> Any:
        """In the order in which the values are given."""
        return self._values[min(int(np.searchsorted(self._until, probability)), len(self._values) - 1)]

    def support(self) -> list[Any]:
        """All values."""
        return self._values


class Truncated(Distribution):
    """Another distribution between bounds."""

    keys = ()

    def __init__(self, whole: Distribution, low: float, high: float) -> None:
        """Cut a distribution; raises ConfigurationError for bounds that leave nothing of it."""
        self._whole, self._low, self._high = whole, low, high
        self._below, self._until = whole.probability(low), whole.probability(high)
        if not self._until > self._below:
            raise ConfigurationError(
                f"{WITHIN}: [{low!r}, {high!r}] is not allowed; nothing of the distribution is in it"
            )

    def quantile(self, probability: float) -> float:
        """That of the whole, within the bounds."""
        inside = self._below + probability * (self._until - self._below)
        value = float(self._whole.quantile(min(max(inside, LEAST), 1.0 - LEAST)))
        return min(max(value, self._low), self._high)


class HillNormal(Distribution):
    """Relative position and velocity, jointly normal about zero: a covariance in the Hill frame."""

    keys = ("sigma", "correlation")

    def __init__(self, sigma: Sequence[float], correlation: Mapping[str, float] | None = None) -> None:
        """Hold six standard deviations, m and m/s, and correlations by two components, such as `x vy`."""
        good = isinstance(sigma, list | tuple) and all(isinstance(each, int | float) and each >= 0 for each in sigma)
        if not good or len(sigma) != len(STATE):
            raise ConfigurationError(f"sigma: {sigma!r} is not allowed; it must be 6 numbers of at least 0, m and m/s")
        matrix = np.eye(len(STATE))
        for pair, value in (correlation or {}).items():
            components = pair.split()
            if len(components) != 2 or not set(components) <= set(STATE) or components[0] == components[1]:
                raise ConfigurationError(
                    f"correlation {pair!r}: is unknown; it must be two of {' '.join(STATE)}, as 'x vy'"
                )
            if not isinstance(value, int | float) or not -1.0 <= value <= 1.0:
                raise ConfigurationError(f"correlation {pair!r}: {value!r} is not allowed; it must be from -1 to 1")
            one, other = map(STATE.index, components)
            matrix[one, other] = matrix[other, one] = value
        values, vectors = np.linalg.eigh(matrix)
        if values[0] < -1e-12:
            raise ConfigurationError("correlation: is not allowed; the matrix must be positive semidefinite")
        self._factor = np.array(sigma)[:, None] * (vectors * np.sqrt(np.maximum(values, 0.0)))

    def quantile(self, probability: float) -> float:
        """Bound of every component, which is all that one probability can say of six."""
        return float(ndtri(probability)) * float(np.abs(self._factor).sum(axis=1).max())

    def draw(self, random: np.random.Generator, size: int) -> list[Any]:
        """Draw a state; raises ConfigurationError unless it is for one."""
        if size != len(STATE):
            raise ConfigurationError(f"hill_normal: is not allowed for {size} values; it draws a relative state, of 6")
        standard = [float(ndtri(each)) for each in uniforms(random, size).tolist()]
        return [float(sum(a * b for a, b in zip(row, standard, strict=True))) for row in self._factor.tolist()]


DISTRIBUTIONS: dict[str, type[Distribution]] = {
    "normal": Normal,
    "uniform": Uniform,
    "log_normal": LogNormal,
    "choice": Choice,
    "hill_normal": HillNormal,
}


def distribution_of(spec: Any) -> Distribution:
    """Distribution from the file's form, as `{normal: {mean: 1.0, sigma: 0.1}, within: [0.8, 1.2]}`.

    Raises:
        ConfigurationError: another form, an unknown distribution, or numbers that are none.
    """
    if not isinstance(spec, dict):
        raise ConfigurationError(f"{spec!r} is not allowed; it must be like {{normal: {{mean: 1.0, sigma: 0.1}}}}")
    names = [name for name in spec if name != WITHIN]
    if len(names) != 1:
        raise ConfigurationError(
            f"needs one distribution, has {', '.join(names) or 'none'}; known: {', '.join(DISTRIBUTIONS)}"
        )
    name, numbers = names[0], spec[names[0]]
    if name not in DISTRIBUTIONS:
        raise ConfigurationError(f"distribution {name}: unknown; {nearest(name, DISTRIBUTIONS)}")
    kind = DISTRIBUTIONS[name]
    optional = {"weights", "correlation"}
    given = set(numbers) if isinstance(numbers, dict) else set()
    if not isinstance(numbers, dict) or not given <= set(kind.keys) or set(kind.keys) - given - optional:
        raise ConfigurationError(f"{name}: {numbers!r} is not allowed; it must have {', '.join(kind.keys)}")
    try:
        whole = kind(**numbers)
    except ConfigurationError as error:
        raise ConfigurationError(f"{name}: {error}") from None
    return _truncated(whole, name, spec[WITHIN]) if WITHIN in spec else whole


def _truncated(whole: Distribution, name: str, bounds: Any) -> Distribution:
    if isinstance(whole, Choice | HillNormal):
        raise ConfigurationError(f"{WITHIN}: is not allowed for {name}; it truncates normal, uniform and log_normal")
    numbers = bounds if isinstance(bounds, list) else []
    if len(numbers) != 2 or not all(isinstance(each, int | float) and -inf < each < inf for each in numbers):
        raise ConfigurationError(f"{WITHIN}: {bounds!r} is not allowed; it must be two numbers, [low, high]")
    return Truncated(whole, *map(float, numbers))
