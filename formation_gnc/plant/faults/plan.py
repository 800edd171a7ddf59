"""Planned faults: entries written as text, checked before anything flies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, get_origin

import yaml

from formation_gnc.errors import ConfigurationError, ParameterError, nearest
from formation_gnc.limited_yaml import RejectedYamlError
from formation_gnc.parameters import leaves, load, read_yaml
from formation_gnc.plant.faults.fault import Fault
from formation_gnc.plant.faults.registry import FAULTS

if TYPE_CHECKING:
    from formation_gnc.plant.parameters import DeputyParameters

FORM = "{at: 3000.0, until: 6000.0, deputy: deputy1, fault: bias, sensor: radius, value: 20.0}"


@dataclass(frozen=True)
class PlannedFault:
    """One entry of a plan."""

    entry: str
    """The entry as written."""
    name: str
    """Of the fault in the registry."""
    fault: Fault[Any]
    begin: int
    """First tick at which it holds."""
    end: float
    """First tick at which it does no more; infinite for never."""


def plan_faults(
    entries: Sequence[str], deputies: Mapping[str, "DeputyParameters"], tick_ns: int
) -> tuple[PlannedFault, ...]:
    """The faults that entries plan, in their order.

    Args:
        entries: each of the form `{at: SECONDS, until: SECONDS, deputy: NAME, fault: NAME, FIELD: VALUE, ...}`; without
            `until`, the fault lasts.
        deputies: of the run, by name.
        tick_ns: time between ticks, ns.

    Raises:
        ParameterError: an entry of another form, or one that plans what is not allowed.
    """
    planned = []
    for entry in entries:
        try:
            planned.append(_planned(entry, deputies, tick_ns))
        except ConfigurationError as error:
            reason = str(error).removeprefix("parameter ")
            raise ParameterError(f"parameter faults: {entry!r}: {reason}") from None
    return tuple(planned)


def _planned(entry: str, deputies: Mapping[str, "DeputyParameters"], tick_ns: int) -> PlannedFault:
    try:
        values = {str(name): value for name, value in read_yaml(entry).items()}
    except RejectedYamlError as error:
        raise ParameterError(f"is not YAML as ROS 2 reads it, {error}") from None
    except (yaml.YAMLError, AttributeError, ValueError):
        raise ParameterError(f"is not allowed; it must be like '{FORM}' with times in seconds") from None
    name = values.pop("fault", None)
    if name is None:
        raise ParameterError(f"fault: missing; known: {', '.join(FAULTS)}")
    if not isinstance(name, str) or name not in FAULTS:
        raise ParameterError(f"fault: {name!r} is unknown; {nearest(str(name), FAULTS)}")
    fault = _load(name, values)
    if fault.deputy not in deputies:
        raise ParameterError(f"deputy: {fault.deputy!r} is unknown; {nearest(fault.deputy, deputies)}")
    fault.check(deputies[fault.deputy], tick_ns)
    return PlannedFault(entry, name, fault, *fault.ticks(tick_ns))


def _load(name: str, values: dict[str, Any]) -> Fault[Any]:
    """A fault from its fields; one value counts as a list of one."""
    schema = FAULTS[name]
    known = {leaf.name: leaf for leaf in leaves(schema, {})}
    for field, value in values.items():
        if field not in known:
            raise ParameterError(f"{field}: is no field of {name}; {nearest(field, known)}")
        if get_origin(known[field].type) is tuple and not isinstance(value, list):
            values[field] = [value]
    return load(schema, values)
