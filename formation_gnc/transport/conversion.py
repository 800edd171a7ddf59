"""Between the core's records and the bytes that DDS carries: one mechanism, by the names of their fields.

A record is laid out as the middleware lays out the message of the same name: plain CDR, little-endian, every
number aligned to its size. By way of rclpy's message objects the same bytes take three times as long.
"""

import struct
from dataclasses import fields
from functools import cache
from importlib import import_module
from typing import Any, get_args, get_origin, get_type_hints, override

from formation_gnc_msgs import msg as messages
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser.definition import Array, BasicType, NamespacedType, UnboundedString

from formation_gnc import records
from formation_gnc.errors import ConfigurationError
from formation_gnc.transport import cdr

FRAME_IDS = {
    records.Measurement: "inertial",
    records.Truth: "inertial",
    records.Estimate: "hill",
    records.Target: "hill",
    records.Thrust: "hill",
    records.Status: "hill",
    records.Separation: "hill",
}

_CODES = {"boolean": "?", "uint8": "B", "uint32": "I", "uint64": "Q", "double": "d"}


def message_type(record_type: type[Any]) -> Any:
    """The message class of the same name, or of what the record is an extract of."""
    return getattr(messages, "Estimate" if record_type is records.NavigationState else record_type.__name__)


def message_class(type_name: str) -> Any:
    """The class of a message type such as ``std_msgs/msg/String``; raises ConfigurationError for none."""
    try:
        package, kind, name = type_name.split("/")
        return getattr(import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError, ValueError):
        raise ConfigurationError(f"message type {type_name!r} is not installed") from None


def to_cdr(record: Any) -> bytes:
    """The message with the contents of a record, header included; gaps between numbers are zero."""
    kind: Any = type(record)
    return codec(kind).encode(record)


def from_cdr[T](record_type: type[T], data: bytes) -> T:
    """The record with the contents of a message; raises ConfigurationError when the bytes do not fit it."""
    kind: Any = record_type
    record: T = codec(kind).decode(data)
    return record


class _Message(cdr.Codec):
    """A record's message, as the installed message class defines it."""

    def __init__(self, record_type: type[Any]) -> None:
        """Look at the fields of both."""
        self._type = message_type(record_type)
        hints = get_type_hints(record_type)
        shapes = {field.name: field.metadata.get("shape") for field in fields(record_type)}
        slots = zip(self._type.get_fields_and_field_types(), self._type.SLOT_TYPES, strict=True)
        super().__init__(
            record_type,
            [
                cdr.header("time", FRAME_IDS.get(record_type, ""))
                if name == "header"
                else _field(name, slot, hints.get(name), shapes.get(name))
                for name, slot in slots
            ],
        )

    @override
    def meet(self, data: bytes) -> bytes:
        name, size = self._type.__name__, len(data)
        try:
            if not data.startswith(cdr.LITTLE_ENDIAN):  # it writes its numbers the other way round
                data = serialize_message(deserialize_message(data, self._type))
            return super().meet(data)
        except (struct.error, ValueError, RuntimeError) as error:
            raise ConfigurationError(f"{size} bytes do not fit message type {name}: {error}") from None


@cache
def codec(record_type: Any) -> cdr.Codec:
    """What encodes and decodes the records of a type, for who does it again and again."""
    return _Message(record_type)


def _field(name: str, slot: Any, hint: Any, shape: tuple[int, ...] | None) -> cdr.Field:
    """A message's field, for a record that annotates it with `hint`."""
    if isinstance(slot, UnboundedString):
        return cdr.text(name)
    if isinstance(slot, BasicType):
        return cdr.number(name, _CODES[slot.typename])
    if isinstance(slot.value_type, NamespacedType):
        (item,) = get_args(hint)
        return cdr.records(name, codec(item))
    code, number = _CODES[slot.value_type.typename], slot.size if isinstance(slot, Array) else -1
    if get_origin(hint) is list:
        return cdr.sequence(name, code) if number < 0 else cdr.numbers(name, code, number)
    return cdr.array(name, code, shape or (number,))
