"""Records to and from the bytes of their messages, as the installed message definitions lay them out.

rclpy's message objects would take three times as long for the same bytes.
"""

import dataclasses
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any, get_args, get_origin, get_type_hints

from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser.definition import Array, BasicType, NamespacedType, UnboundedString

from formation_gnc.bounds import checked, has_bounds
from formation_gnc.errors import ConfigurationError
from formation_gnc.records import Record
from formation_gnc.transport import fields as cdr_fields
from formation_gnc.transport.cdr import Codec
from formation_gnc.transport.fields import Field

PACKAGE = "formation_gnc_msgs"
"""Where the messages of records are defined that name no other package."""

_CODES = {
    "boolean": "?",
    "octet": "B",
    **{"int8": "b", "int16": "h", "int32": "i", "int64": "q"},
    **{"uint8": "B", "uint16": "H", "uint32": "I", "uint64": "Q"},
    **{"float": "f", "double": "d"},
}
_TIMES = [("builtin_interfaces", "msg", name) for name in ("Time", "Duration")]


def type_name(record_type: type[Record]) -> str:
    """Name of the message type that a record mirrors, such as ``formation_gnc_msgs/msg/Thrust``."""
    package, _, name = record_type.message.rpartition("/")
    return f"{package or PACKAGE}/msg/{name}"


def message_type(record_type: type[Record]) -> Any:
    """Class of the message that a record mirrors."""
    return message_class(type_name(record_type))


def message_class(type_name: str) -> Any:
    """The class of a message type such as ``std_msgs/msg/String``; raises ConfigurationError for none."""
    try:
        package, kind, name = type_name.split("/")
        return getattr(import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError, ValueError):
        raise ConfigurationError(f"message type {type_name!r} is not installed") from None


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
    kind = message_type(record_type)

    def to_little_endian(data: bytes) -> bytes:
        swapped: bytes = serialize_message(deserialize_message(data, kind))
        return swapped

    return Codec(record_type, record_type.message, list(_fields(kind, record_type)), to_little_endian)


def _fields(kind: Any, record_type: type[Record] | None) -> Iterator[Field]:
    """All fields of a message, for a record that has some of them, or none."""
    hints = get_type_hints(record_type) if record_type else {}
    shapes: dict[str, Any] = {}
    if record_type is not None and dataclasses.is_dataclass(record_type):
        shapes = {field.name: field.metadata.get("shape") for field in dataclasses.fields(record_type)}
    names = kind.get_fields_and_field_types()
    unknown = shapes.keys() - names - {"time"}
    if unknown:
        raise TypeError(f"record {record_type}: message {kind.__name__} has no {', '.join(sorted(unknown))}")
    for name, slot in zip(names, kind.SLOT_TYPES, strict=True):
        if name == "header":
            yield cdr_fields.header("time", record_type.frame_id if record_type else "")
        else:
            yield _field(name, slot, hints.get(name), shapes.get(name))


def _field(name: str, slot: Any, hint: Any, shape: tuple[int, ...] | None) -> Field:
    """A message's field, for a record that annotates it with `hint`; None if it lacks it."""
    if isinstance(slot, UnboundedString):
        return cdr_fields.text(name)
    if isinstance(slot, BasicType):
        return cdr_fields.number(name, _CODES[slot.typename])
    if _is_time(slot):
        return cdr_fields.time(name)
    element, size = getattr(slot, "value_type", None), slot.size if isinstance(slot, Array) else None
    if isinstance(element, BasicType):
        code = _CODES[element.typename]
        if get_origin(hint) is list:
            return cdr_fields.numbers(name, code, size) if size else cdr_fields.sequence(name, code)
        return cdr_fields.array(name, code, shape or (size,)) if size else cdr_fields.rows(name, code, ())
    if isinstance(element, NamespacedType) and size is None:
        return _sequence_of_messages(name, message_class("/".join(element.namespaced_name())), hint)
    raise TypeError(f"field {name}: {slot} has no counterpart in records")


def _sequence_of_messages(name: str, kind: Any, hint: Any) -> Field:
    """A list of records; or an array with a row for each message, for those of times or numbers of one type."""
    if hint is None or get_origin(hint) is list:
        record_type = get_args(hint)[0] if hint else None
        return cdr_fields.records(name, record_type, list(_fields(kind, record_type)))
    if all(map(_is_time, kind.SLOT_TYPES)):
        return cdr_fields.times(name, len(kind.SLOT_TYPES))
    elements = [slot.value_type if isinstance(slot, Array) else slot for slot in kind.SLOT_TYPES]
    types = {element.typename if isinstance(element, BasicType) else "" for element in elements}
    if len(types) > 1 or "" in types:
        raise TypeError(f"field {name}: {kind.__name__} has other fields than numbers of one type")
    width = sum(slot.size if isinstance(slot, Array) else 1 for slot in kind.SLOT_TYPES)
    return cdr_fields.rows(name, _CODES[types.pop()], (width,))


def _is_time(slot: Any) -> bool:
    return isinstance(slot, NamespacedType) and slot.namespaced_name() in _TIMES
