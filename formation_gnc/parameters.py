"""Typed schemas of parameters.

A schema is a frozen dataclass whose fields are made with :func:`parameter`. Declaration as ROS parameters,
checks, YAML defaults and the reference page all come from it. Nested schemas become dotted names. A field
made with :func:`per_name` holds one nested schema for every name that another field lists, one made with
:func:`per_entry` the schema of every entry of a registry; those names are the prefix: ``deputy1.mass``,
``lqr.thrust``.
"""

import dataclasses
import json
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass
from typing import Any, get_args, get_origin, get_type_hints

import yaml

from formation_gnc.errors import ConfigurationError, ParameterError, nearest
from formation_gnc.parameter_yaml import ParameterLoader
from formation_gnc.records import ParameterChange
from formation_gnc.units import to_si

OWN_OF_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides")
"""Prefixes of parameters that every ROS node may have besides its schema."""


def read_yaml(text: str) -> Any:
    """Contents of a YAML document of parameters, every value as ROS 2 reads it.

    Raises:
        yaml.YAMLError: invalid YAML, or what ROS 2 refuses, with its line.
    """
    return yaml.load(text, Loader=ParameterLoader)


@dataclass(frozen=True)
class Limits:
    """Meaning of a parameter and its allowed values."""

    doc: str
    unit: str = ""
    minimum: float = -math.inf
    above: float = -math.inf
    """Exclusive lower bound."""
    maximum: float = math.inf
    choices: Collection[str] = ()
    """Allowed strings; a registry stands for the names that it has when a value is checked."""
    length: int | None = None
    """Number of values of an array; None for any."""
    in_flight: bool = False
    """Whether it may change in flight."""
    follows: str = ""
    """The plant's parameter whose value it has unless it is given: see :mod:`formation_gnc.sil.following`."""

    def allowed(self) -> str:
        """Allowed values in words."""
        words = []
        if self.choices:
            words.append("one of " + ", ".join(self.choices))
        if self.length is not None:
            words.append(f"{self.length} values")
        if self.above > -math.inf:
            words.append(f"above {self.above:g}")
        if self.minimum > -math.inf:
            words.append(f"at least {self.minimum:g}")
        if self.maximum < math.inf:
            words.append(f"at most {self.maximum:g}")
        return ", ".join(words)


def parameter(default: Any = MISSING, **limits: Any) -> Any:
    """Declare a parameter: its default (without one it is required) and its :class:`Limits` by keyword."""
    return dataclasses.field(default=default, metadata={"limits": Limits(**limits)})


def per_name(names: str) -> Any:
    """Declare a dict of nested schemas, one for each name that the parameter `names` lists."""
    return dataclasses.field(default_factory=dict, metadata={"names": names})


def per_entry(registry: Mapping[str, Any]) -> Any:
    """Declare a dict of nested schemas: `Parameters` of each entry of a registry, by the entry's name.

    The registry is read at every use: an entry added after import has its parameters like any other. They
    all have defaults, since a node has the parameters of every entry and uses those of one.
    """
    return dataclasses.field(
        default_factory=lambda: {name: entry.Parameters() for name, entry in registry.items()},
        metadata={"registry": registry},
    )


def with_fields[T](more: Iterable[tuple[str, Any, Any]]) -> Callable[[type[T]], type[T]]:
    """Declare more fields of a schema, below ``@dataclass``: name, type and value, such as :func:`parameter`."""

    def extend(schema: type[T]) -> type[T]:
        for name, kind, value in more:
            if hasattr(schema, name):
                raise ParameterError(f"parameter {name}: {schema.__name__} has another one of this name")
            schema.__annotations__[name] = kind
            setattr(schema, name, value)
        return schema

    return extend


@dataclass(frozen=True)
class Leaf:
    """A parameter with its full dotted name, Python type and default."""

    name: str
    type: Any
    default: Any
    limits: Limits

    @property
    def type_name(self) -> str:
        """Name of the type in ROS 2."""
        scalar = {bool: "bool", int: "integer", float: "double", str: "string"}
        if get_origin(self.type) is tuple:
            return f"{scalar[get_args(self.type)[0]]} array"
        return scalar[self.type]

    def check(self, value: Any) -> Any:
        """`value` in the parameter's type; arrays and scalars of NumPy and of ROS count as lists and numbers.

        Raises:
            ParameterError: the value is not allowed.
        """
        value = _plain(value)
        units = self.limits.unit.split(", ")
        if get_origin(self.type) is not tuple:
            return self._check_scalar(self._in_si(value, self.type, units[0]), self.type)
        if not _is_list(value):
            raise self._rejection(value, f"a list ({self.type_name})")
        kind, count = get_args(self.type)[0], len(value)
        in_si = [self._in_si(_plain(item), kind, units[i * len(units) // count]) for i, item in enumerate(value)]
        values = tuple(self._check_scalar(item, kind) for item in in_si)
        if self.limits.length is not None and len(values) != self.limits.length:
            raise self._rejection(list(value), self.limits.allowed())
        return values

    def _in_si(self, value: Any, kind: type, unit: str) -> Any:
        """A number given as text with its unit, in SI; anything else as it is."""
        if not (kind is float and isinstance(value, str)):
            return value
        try:
            converted = to_si(value, unit)
        except ConfigurationError as error:
            raise ParameterError(f"parameter {self.name}: {value!r}: {error}") from None
        return value if converted is None else converted

    def _check_scalar(self, value: Any, kind: type) -> Any:
        if isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise self._rejection(value, "within 64 bits, as ROS carries it")
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise self._rejection(value, f"a value of type {self.type_name}")
        if isinstance(value, float) and not math.isfinite(value):
            raise self._rejection(value, "finite")
        limits = self.limits
        if limits.choices and value not in limits.choices:
            raise self._rejection(value, limits.allowed())
        if kind in (int, float) and not (limits.minimum <= value <= limits.maximum and value > limits.above):
            raise self._rejection(value, limits.allowed())
        return value

    def nearest(self, value: Any) -> Any:
        """A number, or each of a list, moved into the inclusive range."""
        if _is_list(value):
            return tuple(map(self.nearest, value))
        if isinstance(value, int | float) and not isinstance(value, bool):
            return min(max(value, self.limits.minimum), self.limits.maximum)
        return value

    def _rejection(self, value: Any, allowed: str) -> ParameterError:
        return ParameterError(f"parameter {self.name}: {value!r} is not allowed; it must be {allowed}")


def _plain(value: Any) -> Any:
    """Arrays and scalars of NumPy and of ROS as lists and numbers of Python."""
    return value.tolist() if hasattr(value, "tolist") else value


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _members(field: dataclasses.Field[Any], kind: Any, listed: Any) -> dict[str, type] | None:
    """Nested schemas by name of a field made with :func:`per_name` or :func:`per_entry`; None for any other.

    `kind` is the field's type, `listed` the value of the parameter that lists the names.
    """
    if "registry" in field.metadata:
        return {name: entry.Parameters for name, entry in field.metadata["registry"].items()}
    if "names" in field.metadata:
        return {str(name): get_args(kind)[1] for name in (listed if _is_list(listed) else ())}
    return None


def leaves(schema: type, values: Mapping[str, Any], prefix: str = "", defaults: Any = MISSING) -> Iterator[Leaf]:
    """All parameters of a schema, in order.

    Args:
        schema: dataclass of parameters.
        values: by dotted name; those of lists of names define the nested schemas of `per_name`.
        prefix: of the dotted names.
        defaults: instance whose fields override the schema's defaults, so that two nested schemas of one
            type may have different ones.
    """
    hints = get_type_hints(schema)
    fields = {field.name: field for field in dataclasses.fields(schema)}
    for field in fields.values():
        kind, name = hints[field.name], prefix + field.name
        source = field.metadata.get("names")
        listed = values.get(prefix + source, fields[source].default) if source else ()
        members = _members(field, kind, listed)
        if members is not None:
            for key, nested in members.items():
                yield from leaves(nested, values, f"{prefix}{key}.")
            continue
        default = field.default if defaults is MISSING else getattr(defaults, field.name)
        if dataclasses.is_dataclass(kind):
            yield from leaves(kind, values, f"{name}.", default)  # type: ignore[arg-type]
        else:
            yield Leaf(name, kind, default, field.metadata["limits"])


def load[T](schema: type[T], values: Mapping[str, Any]) -> T:
    """Instance of a schema from values by dotted name.

    Raises:
        ParameterError: a parameter is unknown, missing, of another type, out of range or not finite.
    """
    known = {leaf.name: leaf for leaf in leaves(schema, values)}
    for name in values:
        if name not in known:
            raise ParameterError(f"parameter {name}: unknown; {nearest(name, known)}")
    checked = {}
    for leaf in known.values():
        if leaf.name in values:
            checked[leaf.name] = leaf.check(values[leaf.name])
        elif leaf.default is MISSING:
            raise ParameterError(f"parameter {leaf.name}: missing; give a {leaf.type_name}")
        else:
            checked[leaf.name] = leaf.default
    return _build(schema, checked, "")


def to_json(value: Any) -> str:
    """A parameter's value as JSON; tuples, numeric arrays of ROS and NumPy, and bytes become lists of numbers."""
    return json.dumps(value, default=lambda each: int.from_bytes(each) if isinstance(each, bytes) else _plain(each))


def from_json(text: str) -> Any:
    """A parameter's value from JSON; raises ValueError for what is none, or is nested too deeply."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _build[T](schema: type[T], checked: Mapping[str, Any], prefix: str) -> T:
    hints = get_type_hints(schema)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(schema):  # type: ignore[arg-type]
        kind, name = hints[field.name], prefix + field.name
        members = _members(field, kind, fields.get(field.metadata.get("names", "")))
        if members is not None:
            fields[field.name] = {key: _build(each, checked, f"{prefix}{key}.") for key, each in members.items()}
        elif dataclasses.is_dataclass(kind):
            fields[field.name] = _build(kind, checked, f"{name}.")  # type: ignore[arg-type]
        else:
            fields[field.name] = checked[name]
    return schema(**fields)


def dump(instance: Any, prefix: str = "") -> dict[str, Any]:
    """Values of an instance by dotted name, the inverse of :func:`load`."""
    flat: dict[str, Any] = {}
    for field in dataclasses.fields(instance):
        value = getattr(instance, field.name)
        if field.metadata.keys() & {"names", "registry"}:
            for key, nested in value.items():
                flat |= dump(nested, f"{prefix}{key}.")
        elif dataclasses.is_dataclass(value):
            flat |= dump(value, f"{prefix}{field.name}.")
        else:
            flat[prefix + field.name] = value
    return flat


def change[T](instance: T, changes: Mapping[str, Any]) -> T:
    """Copy of `instance` with parameters changed in flight.

    Raises:
        ParameterError: as for :func:`load`, or a parameter cannot change in flight.
    """
    values = dump(instance)
    for leaf in leaves(type(instance), values):
        if leaf.name not in changes or leaf.limits.in_flight:
            continue
        if leaf.check(changes[leaf.name]) != values.get(leaf.name, leaf.default):
            raise ParameterError(f"parameter {leaf.name}: cannot change in flight; set it at the start")
    return load(type(instance), values | dict(changes))


def differences(before: Any, after: Any) -> dict[str, Any]:
    """Values of `after` by dotted name where they differ from those of `before`."""
    old = dump(before)
    return {name: value for name, value in dump(after).items() if name not in old or old[name] != value}


def change_in_words(before: Any, after: Any) -> tuple[list[ParameterChange], str]:
    """Differences of two instances of a schema for an event: as records, and for people."""
    old, new = dump(before), differences(before, after)
    changes = [ParameterChange(name, to_json(old[name]), to_json(value)) for name, value in new.items()]
    return changes, ", ".join(f"{name}: {_text(old[name])} -> {_text(value)}" for name, value in new.items())


def _text(value: Any) -> str:
    return value if isinstance(value, str) else to_json(value)
