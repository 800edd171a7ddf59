"""Between the core's records and ROS messages: one mechanism for all, by the names of their fields."""

import array
import dataclasses
from collections.abc import Callable
from importlib import import_module
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from formation_gnc_msgs import msg as messages

from formation_gnc import interface
from formation_gnc.errors import ConfigurationError
from formation_gnc.interface import NANOSECONDS

_FIELDS: dict[type[Any], "tuple[_Field, ...]"] = {}

FRAME_IDS = {
    interface.Measurement: "inertial",
    interface.Truth: "inertial",
    interface.Estimate: "hill",
    interface.Target: "hill",
    interface.Thrust: "hill",
    interface.Status: "hill",
}


@dataclasses.dataclass(frozen=True, slots=True)
class _Field:
    """How one field of a record becomes a field of its message, and back; None leaves the value as it is."""

    name: str
    encode: Callable[[Any], Any] | None
    decode: Callable[[Any], Any] | None


def message_type(record_type: type[Any]) -> Any:
    """The message class of the same name."""
    return getattr(messages, record_type.__name__)


def message_class(type_name: str) -> Any:
    """The class of a message type such as ``std_msgs/msg/String``; raises ConfigurationError for none."""
    try:
        package, kind, name = type_name.split("/")
        return getattr(import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError, ValueError):
        raise ConfigurationError(f"message type {type_name!r} is not installed") from None


def to_message(record: Any, message: Any = None) -> Any:
    """A ROS message with the contents of a record, header included; an old `message` may be used again."""
    kind = type(record)
    message = message or message_type(kind)()
    for field in _fields(kind):
        value = getattr(record, field.name)
        setattr(message, field.name, field.encode(value) if field.encode else value)
    if hasattr(record, "time"):
        header = message.header
        header.stamp.sec, header.stamp.nanosec = divmod(record.time, NANOSECONDS)
        header.frame_id = FRAME_IDS.get(kind, "")
    return message


def from_message[T](record_type: type[T], message: Any) -> T:
    """The record with the contents of a ROS message."""
    values = {
        field.name: field.decode(getattr(message, field.name))
        if field.decode
        else getattr(message, field.name)
        for field in _fields(record_type)
    }
    if hasattr(message, "header"):
        values["time"] = stamp(message)
    return record_type(**values)


def stamp(message: Any) -> int:
    """A message's stamp in nanoseconds."""
    time = message.header.stamp
    return int(time.sec * NANOSECONDS + time.nanosec)


def _fields(record_type: type[Any]) -> tuple[_Field, ...]:
    if record_type not in _FIELDS:
        _FIELDS[record_type] = _analyse(record_type)
    return _FIELDS[record_type]


def _analyse(record_type: type[Any]) -> tuple[_Field, ...]:
    hints = get_type_hints(record_type)
    return tuple(
        _field(field, hints[field.name]) for field in dataclasses.fields(record_type) if field.name != "time"
    )


def _field(field: Any, kind: Any) -> _Field:
    shape = field.metadata.get("shape")
    if shape and -1 in shape:  # an array of any length
        return _Field(
            field.name,
            lambda value: array.array("d", value.tobytes()),
            lambda value: np.array(value, dtype=np.float64).reshape(shape),
        )
    if shape:
        return _Field(field.name, np.ravel, lambda value: value.reshape(shape))
    if get_origin(kind) is list and dataclasses.is_dataclass(get_args(kind)[0]):
        (item,) = get_args(kind)
        return _Field(
            field.name,
            lambda value: [to_message(each) for each in value],
            lambda value: [from_message(item, each) for each in value],
        )
    if get_origin(kind) is list:
        return _Field(field.name, None, list)
    return _Field(field.name, None, None)
