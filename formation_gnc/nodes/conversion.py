"""Between the core's records and the bytes that DDS carries: one mechanism, by the names of their fields.

A record is laid out as the middleware lays out the message of the same name: plain CDR, little-endian, every
number aligned to its size. By way of rclpy's message objects the same bytes take three times as long.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import cache
from importlib import import_module
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from formation_gnc_msgs import msg as messages
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser.definition import Array, BasicType, NamespacedType, UnboundedString

from formation_gnc import interface
from formation_gnc.errors import ConfigurationError
from formation_gnc.nodes import cdr

FRAME_IDS = {
    interface.Measurement: "inertial",
    interface.Truth: "inertial",
    interface.Estimate: "hill",
    interface.Target: "hill",
    interface.Thrust: "hill",
    interface.Status: "hill",
    interface.Separation: "hill",
}

_CODES = {"boolean": "?", "uint8": "B", "uint32": "I", "uint64": "Q", "double": "d"}


def message_type(record_type: type[Any]) -> Any:
    """The message class of the same name, or of what the record is an extract of."""
    return getattr(messages, "Estimate" if record_type is interface.NavigationState else record_type.__name__)


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
    return _codec(kind).encode(record)


def from_cdr[T](record_type: type[T], data: bytes) -> T:
    """The record with the contents of a message; raises ConfigurationError when the bytes do not fit it."""
    kind: Any = record_type
    record: T = _codec(kind).decode(data)
    return record


class _Codec:
    """How a record becomes its message, and back; what it lacks of the message is passed over."""

    def __init__(self, record_type: type[Any]) -> None:
        """Look at the fields of both."""
        self._type, self._message_type = record_type, message_type(record_type)
        hints = get_type_hints(record_type)
        shapes = {field.name: field.metadata.get("shape") for field in fields(record_type)}
        slots = zip(
            self._message_type.get_fields_and_field_types(), self._message_type.SLOT_TYPES, strict=True
        )
        self._fields: list[tuple[str, cdr.Kind]] = []
        for name, slot in slots:
            if name == "header":
                self._fields.append(("time", cdr.Header(FRAME_IDS.get(record_type, ""), cdr.Text())))
            else:
                self._fields.append((name, _kind(slot, hints.get(name), shapes.get(name))))
        *_, last = (index for index, (name, _) in enumerate(self._fields) if name in hints)
        self._wanted = [(name, kind, name in hints) for name, kind in self._fields[: last + 1]]
        self._drawn: dict[tuple[int, ...], cdr.Layout] = {}
        self._met: dict[int, cdr.Layout] = {}

    def encode(self, record: Any) -> bytes:
        """The message with a record's contents."""
        values, counts = list[Any]([cdr.ENCAPSULATION]), list[int]()
        self.write(record, values, counts)
        layout = self._drawn.get(tuple(counts))
        if layout is None:
            told = iter(counts)
            layout = self._drawn[tuple(counts)] = self._lay_out(lambda place: next(told))
        return layout.whole.pack(*values)

    def decode(self, data: bytes) -> Any:
        """The record with a message's contents."""
        if data[:2] != cdr.ENCAPSULATION[:2]:  # from a machine that writes its numbers the other way round
            data = serialize_message(deserialize_message(data, self._message_type))
        layout = self._met.get(len(data))
        try:
            if layout is None or layout.probe.unpack_from(data) != layout.counts:
                layout = self._lay_out(lambda place: _count_at(data, place))
                self._met[len(data)] = layout
            values = iter(layout.whole.unpack_from(data))
        except struct.error as error:
            name = self._message_type.__name__
            raise ConfigurationError(f"{len(data)} bytes do not fit message type {name}: {error}") from None
        next(values)
        return self.read(values)

    def _lay_out(self, tell: Callable[[int], int]) -> cdr.Layout:
        pen = cdr.Pen(tell)
        self.draw(pen)
        return pen.layout()

    def draw(self, pen: cdr.Pen) -> None:
        """Lay all fields out."""
        for _, kind in self._fields:
            kind.draw(pen)

    def write(self, record: Any, values: list[Any], counts: list[int]) -> None:
        """Append the values of all fields."""
        for name, kind in self._fields:
            kind.write(getattr(record, name), values, counts)

    def read(self, values: Iterator[Any]) -> Any:
        """The record from the values of all fields."""
        found = {}
        for name, kind, is_wanted in self._wanted:
            value = kind.read(values)
            if is_wanted:
                found[name] = value
        return self._type(**found)


def _count_at(data: bytes, place: int) -> int:
    (count,) = cdr.COUNT.unpack_from(data, place)
    if count > len(data):
        raise struct.error(f"{count} of something")
    return int(count)


@cache
def _codec(record_type: Any) -> _Codec:
    return _Codec(record_type)


def _kind(slot: Any, hint: Any, shape: tuple[int, ...] | None) -> cdr.Kind:
    """What a message's field is, as a record has it that annotates it with `hint`."""
    if isinstance(slot, UnboundedString):
        return cdr.Text()
    if isinstance(slot, BasicType):
        return cdr.Number(_CODES[slot.typename])
    if isinstance(slot.value_type, NamespacedType):
        (item,) = get_args(hint)
        return cdr.Records(_codec(item))
    number = slot.size if isinstance(slot, Array) else None
    is_list = get_origin(hint) is list
    dtype = np.dtype(_CODES[slot.value_type.typename])
    return cdr.Numbers(dtype, number, None if is_list else shape or (-1,))
