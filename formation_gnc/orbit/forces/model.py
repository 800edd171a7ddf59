"""The force model: the Earth's gravity field and the registered forces, compiled into one sum."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit import sky
from formation_gnc.orbit.atmosphere import CIRA, Nrlmsis
from formation_gnc.orbit.environment import Environment
from formation_gnc.orbit.ephemerides import EPHEMERIDES, de421
from formation_gnc.orbit.forces import harmonics, zonal
from formation_gnc.orbit.forces.egm2008 import MAXIMUM_DEGREE
from formation_gnc.orbit.forces.force import Body, Floats, Force, Surroundings, Vector3
from formation_gnc.orbit.forces.registry import FORCES
from formation_gnc.orbit.jit import inline
from formation_gnc.parameters import leaves, parameter

Array = NDArray[np.float64]
Sum = Callable[..., Vector3]

_OWN_SETTINGS = 3
"""Settings of `Forces` itself, which come first: the gravity field's, and the ephemerides."""


def _with_registered_parameters[T](schema: type[T]) -> type[T]:
    """Make the class a frozen dataclass whose fields are its own and the parameters of `FORCES`."""
    for force in FORCES:
        for name, field in force.parameters.items():
            if name in schema.__annotations__:
                raise ValueError(f"parameter {name} of a force: another one has this name; each must be unique")
            schema.__annotations__[name] = type(field.default)
            setattr(schema, name, field)
    return dataclass(frozen=True)(schema)


@_with_registered_parameters
class Forces:
    """Which forces act besides thrust: the Earth's gravity field, and the registered ones."""

    zonal_degree: int = parameter(
        2,
        minimum=0,
        maximum=6,
        doc="Highest zonal harmonic of the Earth: 2 is J2; below 2, none",
    )
    harmonics_degree: int = parameter(
        0,
        minimum=0,
        maximum=MAXIMUM_DEGREE,
        doc="Degree and order of EGM2008 in place of the zonal harmonics; 0 leaves them in force",
    )
    ephemeris: str = parameter(
        "series",
        choices=EPHEMERIDES,
        doc="Positions of Sun and Moon: low-precision series, or JPL's DE421",
    )

    def settings(self) -> Array:
        """The fields in order, for the compiled sum; a choice as its number.

        Raises:
            ConfigurationError: a value out of its range.
        """
        numbers = []
        for leaf in leaves(type(self), {}):
            value = leaf.check(getattr(self, leaf.name))
            numbers.append(float(list(leaf.limits.choices).index(value) if isinstance(value, str) else value))
        return np.array(numbers)

    def environment(self) -> Environment:
        """Surroundings of the satellites with the ephemeris and the density model that are chosen.

        Raises:
            ConfigurationError: a package that they need is not installed.
        """
        sun, moon = de421() if self.ephemeris == "de421" else (sky.sun, sky.moon)
        air = vars(self)  # parameters of the registered drag
        with_nrlmsis = air["drag"] and air["density_model"] == "nrlmsis"
        density = Nrlmsis(air["f107"], air["f107a"], air["ap"]) if with_nrlmsis else CIRA
        return Environment(sun=sun, moon=moon, density=density)

    def ephemerides(self) -> int:
        """Ephemerides that the forces in use need, as bits for `formation_gnc.orbit.sky.look_up`."""
        needed = sky.EARTH_ROTATION if self.harmonics_degree else 0
        for force in FORCES:
            needed |= force.ephemerides if self._is_on(force) else 0
        return needed

    def coefficients(self, bodies: Sequence[Body]) -> Array:
        """(N, len(FORCES)) property of each body that each force is proportional to; zero for none.

        Raises:
            ConfigurationError: no bodies for a force in use that depends on them, or a value of a body out of
                its range.
        """
        for force in FORCES:
            if force.coefficient is not None and self._is_on(force) and not bodies:
                raise ConfigurationError(f"bodies is empty: {_switch(force)} needs one for each satellite")
        for body in bodies:
            for leaf in leaves(Body, {}):
                leaf.check(getattr(body, leaf.name))
        return np.array(
            [[force.coefficient(body) if force.coefficient else 0.0 for force in FORCES] for body in bodies]
        ).reshape(-1, len(FORCES))

    def _is_on(self, force: Force) -> bool:
        return bool(getattr(self, _switch(force)))


def _switch(force: Force) -> str:
    return next(iter(force.parameters))


@inline
def _gravity_field(settings: Floats, around: Surroundings, state: Floats, by_degree: Array, field: Array) -> Vector3:
    x, y, z = state[:3]
    mu, radius = around.mu, around.radius
    if settings[1] >= 2.0:
        degree, cos_turn, sin_turn = int(settings[1]), around.cos_turn, around.sin_turn
        return harmonics.acceleration(degree, cos_turn, sin_turn, x, y, z, mu, radius, field)
    return zonal.acceleration(int(settings[0]), x, y, z, mu, radius, around.oblateness, by_degree)


def _add(before: Sum, force: Force, column: int, first: int) -> Sum:
    """The sum `before` plus a force, whose coefficient is at `column` and whose settings begin at `first`."""
    of_force, last = force.acceleration, first + len(force.parameters)

    @inline
    def total(gravity: Vector3, settings: Floats, coefficients: Floats, around: Surroundings, state: Floats) -> Vector3:
        ax, ay, az = before(gravity, settings, coefficients, around, state)
        if settings[first] != 0.0:
            bx, by, bz = of_force(settings[first:last], coefficients[column], around, state)
            return ax + bx, ay + by, az + bz
        return ax, ay, az

    return total


@inline
def _gravity_alone(
    gravity: Vector3, settings: Floats, coefficients: Floats, around: Surroundings, state: Floats
) -> Vector3:
    return gravity


def _sum_of_all() -> Sum:
    total: Sum = _gravity_alone
    first = _OWN_SETTINGS
    for column, force in enumerate(FORCES):
        total = _add(total, force, column, first)
        first += len(force.parameters)
    return total


SETTINGS, COEFFICIENTS = len(list(leaves(Forces, {}))), len(FORCES)
"""Length of `Forces.settings`, and columns of `Forces.coefficients`."""

_sum = _sum_of_all()


@inline
def acceleration(
    settings: Floats,
    coefficients: Floats,
    around: Surroundings,
    state: Floats,
    by_degree: Array,
    field: Array,
) -> Vector3:
    """Compiled sum of gravity and all forces in use.

    Called as `Force.acceleration`, with tuples of all settings and of all coefficients over the present mass, and
    with the gravity field: J_n by degree, (7,), and `formation_gnc.orbit.forces.harmonics.derivatives`.
    """
    return _sum(_gravity_field(settings, around, state, by_degree, field), settings, coefficients, around, state)


def _cache_key() -> str:
    digest = sha256()
    for force in FORCES:
        digest.update(repr(list(force.parameters)).encode())
        digest.update(Path(inspect.getfile(inspect.unwrap(force.acceleration))).read_bytes())
    return digest.hexdigest()


CACHE_KEY = _cache_key()
"""For kernels that call `acceleration`: registered forces may come from outside this package."""
