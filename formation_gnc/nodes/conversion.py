"""Between the core's records and ROS messages: one mechanism for all, by the names of their fields."""

import array
import dataclasses
import struct
from collections.abc import Callable
from importlib import import_module
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from formation_gnc_msgs import msg as messages
from rclpy.serialization import deserialize_message

from formation_gnc import interface
from formation_gnc.errors import ConfigurationError
from formation_gnc.interface import NANOSECONDS, Neighbour

FRAME_IDS = {
    interface.Measurement: "inertial",
    interface.Truth: "inertial",
    interface.Estimate: "hill",
    interface.Target: "hill",
    interface.Thrust: "hill",
    interface.Status: "hill",
    interface.Separation: "hill",
}


@dataclasses.dataclass(frozen=True, slots=True)
class _Field:
    """How one field of a record becomes a field of its message, and back; None leaves the value as it is."""

    name: str
    encode: Callable[[Any], Any] | None
    decode: Callable[[Any], Any] | None


@dataclasses.dataclass(frozen=True, slots=True)
class _Codec:
    """How a record becomes its message, and back."""

    fields: tuple[_Field, ...]
    message_type: Any
    frame_id: str | None
    """None for a record without a time, whose message has no header."""


_CODECS: dict[type[Any], _Codec] = {}


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


def blank(record_type: type[Any]) -> Any:
    """A message of the same name, in its frame, to be filled again and again."""
    codec = _codec(record_type)
    message = codec.message_type()
    if codec.frame_id:
        message.header.frame_id = codec.frame_id
    return message


def to_message(record: Any, message: Any = None) -> Any:
    """A ROS message with the contents of a record, header included; a `blank` message may be used again."""
    codec = _codec(type(record))
    message = message or blank(type(record))
    for field in codec.fields:
        value = getattr(record, field.name)
        setattr(message, field.name, field.encode(value) if field.encode else value)
    if codec.frame_id is not None:
        time = message.header.stamp
        time.sec, time.nanosec = divmod(record.time, NANOSECONDS)
    return message


def from_message[T](record_type: type[T], message: Any) -> T:
    """The record with the contents of a ROS message."""
    codec = _codec(record_type)
    values = {
        field.name: field.decode(getattr(message, field.name))
        if field.decode
        else getattr(message, field.name)
        for field in codec.fields
    }
    if codec.frame_id is not None:
        values["time"] = stamp(message)
    return record_type(**values)


_NEIGHBOUR = struct.Struct("<2s2xiI9s7x6d336xd")
"""The beginning of an Estimate in CDR, little-endian: encapsulation, stamp, frame_id, relative_state, then a
covariance and a chief_state left out, and mass."""

_IN_PLACE = b"\0\1", b"\5\0\0\0hill\0"
"""Encapsulation (little-endian) and frame_id with which all of that is where it is looked for."""


def neighbour(data: bytes) -> Neighbour:
    """What a deputy needs of another one's Estimate, from its CDR bytes: a fleet of N hears N (N - 1) of them
    in a tick, and to build them whole takes three times as long as all else that it does."""
    encapsulation, seconds, nanoseconds, frame_id, *state, mass = _NEIGHBOUR.unpack_from(data)
    if (encapsulation, frame_id) != _IN_PLACE:
        whole = deserialize_message(data, messages.Estimate)
        return Neighbour(stamp(whole), np.array(whole.relative_state), whole.mass)
    return Neighbour(seconds * NANOSECONDS + nanoseconds, np.array(state), mass)


def stamp(message: Any) -> int:
    """A message's stamp in nanoseconds."""
    time = message.header.stamp
    return int(time.sec * NANOSECONDS + time.nanosec)


def _codec(record_type: type[Any]) -> _Codec:
    if record_type not in _CODECS:
        _CODECS[record_type] = _analyse(record_type)
    return _CODECS[record_type]


def _analyse(record_type: type[Any]) -> _Codec:
    hints = get_type_hints(record_type)
    return _Codec(
        tuple(
            _field(field, hints[field.name])
            for field in dataclasses.fields(record_type)
            if field.name != "time"
        ),
        message_type(record_type),
        FRAME_IDS.get(record_type, "") if "time" in hints else None,
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
        return _Field(field.name, lambda value: value.reshape(-1), lambda value: value.reshape(shape))
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
