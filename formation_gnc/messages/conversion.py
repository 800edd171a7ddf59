"""Records to and from the bytes of their messages, as the message definitions lay them out.

rclpy's message objects would take three times as long for the same bytes, and need ROS.
"""

import dataclasses
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, get_args, get_origin, get_type_hints

from rosbags.interfaces import Nodetype

from formation_gnc.bounds import checked, has_bounds
from formation_gnc.messages import fields as cdr_fields
from formation_gnc.messages.cdr import Codec
from formation_gnc.messages.definitions import field_definitions, to_little_endian
from formation_gnc.messages.fields import Field
from formation_gnc.records import Record
from formation_gnc.shipped import MESSAGES

_CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    **{"int8": "b", "int16": "h", "int32": "i", "int64": "q"},
    **{"uint8": "B", "uint16": "H", "uint32": "I", "uint64": "Q"},
    **{"float32": "f", "float64": "d"},
}
_TIMES = {"builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"}


def type_name(record_type: type[Record]) -> str:
    """Name of the message type that a record mirrors, such as ``formation_gnc_msgs/msg/Thrust``."""
    package, _, name = record_type.message.rpartition("/")
    return f"{package or MESSAGES}/msg/{name}"


def to_cdr(record: Record) -> bytes:
    """The message with the contents of a record, header included; gaps between numbers are zero."""
    return codec(type(record)).encode(record)


def from_cdr[T: Record](record_type: type[T], data: bytes) -> T:
    """The record with the contents of a message; raises ConfigurationError when the bytes do not fit it."""
    return codec(record_type).decode(data)


def received[T: Record](record_type: type[T]) -> Callable[[bytes], T]:
    """Decoder of messages from elsewhere.

    It raises ConfigurationError for bytes that do not fit the record, and for a value out of the record's bounds.
    """
    decode = codec(record_type).decode
    return (lambda data: checked(decode(data))) if has_bounds(record_type) else decode


def codec[T: Record](record_type: type[T]) -> Codec[T]:
    """Cached codec for a record type."""
    if record_type not in _codecs:
        _codecs[record_type] = _new_codec(record_type)
    return _codecs[record_type]


_codecs: dict[type[Record], Codec[Any]] = {}


def _new_codec[T: Record](record_type: type[T]) -> Codec[T]:
    name = type_name(record_type)
    fields = list(_fields(name, record_type))
    return Codec(record_type, record_type.message, fields, partial(to_little_endian, name))


def _fields(kind: str, record_type: type[Record] | None) -> Iterator[Field]:
    """All fields of a message, for a record that has some of them, or none."""
    hints = get_type_hints(record_type) if record_type else {}
    shapes: dict[str, Any] = {}
    if record_type is not None and dataclasses.is_dataclass(record_type):
        shapes = {field.name: field.metadata.get("shape") for field in dataclasses.fields(record_type)}
    unknown = shapes.keys() - {name for name, _ in field_definitions(kind)} - {"time"}
    if unknown:
        raise TypeError(f"record {record_type}: message {kind} has no {', '.join(sorted(unknown))}")
    for name, definition in field_definitions(kind):
        if name == "header":
            yield cdr_fields.header("time", record_type.frame_id if record_type else "")
        else:
            yield _field(name, definition, hints.get(name), shapes.get(name))


def _field(name: str, definition: tuple[Nodetype, Any], hint: Any, shape: tuple[int, ...] | None) -> Field:
    """A message's field, for a record that annotates it with `hint`; None if it lacks it."""
    node, detail = definition
    if node == Nodetype.BASE and detail[0] == "string":
        return cdr_fields.text(name)
    if node == Nodetype.BASE and detail[0] in _CODES:
        return cdr_fields.number(name, _CODES[detail[0]])
    if _is_time(definition):
        return cdr_fields.time(name)
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        (element, kind), size = detail[0], detail[1] if node == Nodetype.ARRAY else None
        if element == Nodetype.BASE and kind[0] in _CODES:
            code = _CODES[kind[0]]
            if get_origin(hint) is list:
                return cdr_fields.numbers(name, code, size) if size else cdr_fields.sequence(name, code)
            return cdr_fields.array(name, code, shape or (size,)) if size else cdr_fields.rows(name, code, ())
        if element == Nodetype.NAME and size is None:
            return _sequence_of_messages(name, kind, hint)
    raise TypeError(f"field {name}: {definition} has no counterpart in records")


def _sequence_of_messages(name: str, kind: str, hint: Any) -> Field:
    """A list of records; or an array with a row for each message, for those of times or numbers of one type."""
    if hint is None or get_origin(hint) is list:
        record_type = get_args(hint)[0] if hint else None
        return cdr_fields.records(name, record_type, list(_fields(kind, record_type)))
    inner = [definition for _, definition in field_definitions(kind)]
    if all(map(_is_time, inner)):
        return cdr_fields.times(name, len(inner))
    arrays = [(detail[0], detail[1]) if node == Nodetype.ARRAY else ((node, detail), 1) for node, detail in inner]
    codes = {_CODES.get(detail[0]) if node == Nodetype.BASE else None for (node, detail), _ in arrays}
    code = codes.pop()
    if codes or code is None:
        raise TypeError(f"field {name}: {kind} has other fields than numbers of one type")
    return cdr_fields.rows(name, code, (sum(size for _, size in arrays),))


def _is_time(definition: tuple[Nodetype, Any]) -> bool:
    return definition[0] == Nodetype.NAME and definition[1] in _TIMES
