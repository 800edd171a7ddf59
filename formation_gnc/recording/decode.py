"""CDR bytes to arrays and typed messages, by the definition that the bag itself carries."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from formation_gnc.errors import BagError
from formation_gnc.messages.definitions import FieldDefinition, schema_text
from formation_gnc.recording.cdr_layout import CdrLayout, LayoutBuilder, MisfitError
from formation_gnc.types import NANOSECONDS

HEADER, TIME, CLOCK = "std_msgs/msg/Header", "builtin_interfaces/msg/Time", "rosgraph_msgs/msg/Clock"

MOST_VALUES = 1_000_000
"""Most values that a type gives each of its messages: arrays of fixed length, nested ones too."""

LAYOUTS_KEPT = 64
"""Layouts kept for each message length; free text gives ever new ones."""


class MessageType:
    """A message type as its `ros2msg` schema defines it.

    Raises:
        BagError: the definition cannot be read.
    """

    def __init__(self, name: str, schema: bytes, encoding: str) -> None:
        """Parse the definition."""
        self.name = name
        parsers = {"ros2msg": lambda text: get_types_from_msg(text, name), "ros2idl": get_types_from_idl}
        if encoding not in parsers:
            allowed = " or ".join(parsers)
            raise BagError(f"message type {name!r}: schema encoding {encoding!r} is not allowed; it must be {allowed}")
        self._layouts: dict[tuple[bytes, int], list[CdrLayout]] = {}
        self._store = get_typestore(Stores.EMPTY)
        try:
            types = parsers[encoding](schema.decode())
            _check_size(types, name)
            self._store.register(types)
            self._definitions: dict[str, Sequence[FieldDefinition]] = {
                type_name: fields for type_name, (_, fields) in self._store.fielddefs.items()
            }
            if name not in self._definitions:
                raise KeyError(name)
        except (TypesysError, UnicodeDecodeError, KeyError, ValueError, RecursionError) as error:
            raise BagError(f"message type {name!r}: its schema cannot be read: {error}") from None

    @property
    def is_stamped(self) -> bool:
        """Whether its messages begin with a stamp: that of a header, or of the clock."""
        first = self._definitions[self.name][:1]
        kinds = {detail for _, (node, detail) in first if node == Nodetype.NAME}
        return HEADER in kinds or (self.name == CLOCK and TIME in kinds)

    def has_fields_of(self, other: "MessageType") -> bool:
        """Whether both have the same name and fields, nested ones included; constants do not count."""
        return self.name == other.name and self._definitions == other._definitions

    def canonical(self, data: bytes) -> bytes:
        """Serialized message with zeros in the alignment gaps, and nothing after its last field.

        ROS leaves the gaps uninitialized, and `serialize_message` may append padding: two messages with the
        same fields have the same canonical bytes.

        Raises:
            BagError: the bytes do not fit the type.
        """
        content = self._layout(data).content
        return content.pack(*content.unpack_from(data))

    def message(self, data: bytes) -> Any:
        """Decode one message: an object with the fields as attributes, arrays as NumPy arrays.

        Raises:
            BagError: the bytes do not fit the type.
        """
        try:
            return self._store.deserialize_cdr(self.canonical(data), self.name)
        except (SerdeError, KeyError) as error:
            raise self._misfit(error) from None

    def arrays(self, messages: Sequence[bytes], fields: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
        """Decode many messages of the type: an array per field, a row per message.

        Nested fields are dotted, elements of message and string arrays numbered ("deputies.0.mass");
        number arrays are stacked to shape (n, length). Where length or presence differs between messages the
        column has dtype object: an array or value per message, None where there is none.

        Args:
            messages: serialized, (n,).
            fields: of the type, with what is nested in them; None for all.

        Raises:
            BagError: the bytes do not fit the type.
        """
        by_layout: dict[int, tuple[CdrLayout, list[int]]] = {}
        for row, data in enumerate(messages):
            layout = self._layout(data)
            by_layout.setdefault(id(layout), (layout, []))[1].append(row)
        columns: dict[str, list[tuple[list[int], NDArray[Any]]]] = {}
        for layout, rows in by_layout.values():
            records = np.frombuffer(b"".join([messages[row] for row in rows]), layout.dtype)
            for field in layout.dtype.names or ():
                if fields is None or field.partition(".")[0] in fields:
                    columns.setdefault(field, []).append((rows, _native(records[field])))
        return {field: _merge(parts, len(messages)) for field, parts in columns.items()}

    def fits(self, data: bytes) -> bool:
        """Whether a message can be decoded."""
        try:
            self._layout(data)
        except BagError:
            return False
        return True

    def _layout(self, data: bytes) -> CdrLayout:
        """Layout of a message: a known one with the same element counts, or a new one."""
        known = self._layouts.setdefault((data[:2], len(data)), [])
        for layout in known:
            if layout.fits(data):
                return layout
        if len(known) >= LAYOUTS_KEPT:
            known.clear()
        try:
            known.append(LayoutBuilder(self._definitions, data).build(self.name))
        except MisfitError as error:
            raise self._misfit(error) from None
        except KeyError as error:
            raise BagError(f"message type {self.name!r}: its schema lacks {error}") from None
        return known[-1]

    def _misfit(self, reason: Exception) -> BagError:
        return BagError(f"message type {self.name!r}: a message does not fit it: {reason}")


def _check_size(types: Mapping[str, tuple[Any, Sequence[FieldDefinition]]], name: str) -> None:
    """Raise ValueError for a type that contains itself, or whose messages have more values than a message may."""
    values: dict[str, int] = {}

    def of_type(name: str, above: tuple[str, ...]) -> int:
        if name in above:
            raise ValueError(f"{name} contains itself")
        if name not in values and name in types:
            values[name] = sum(of_field(field, (*above, name)) for _, field in types[name][1])
        if values.get(name, 0) > MOST_VALUES:
            raise ValueError(f"{name} has {values[name]} values, must be at most {MOST_VALUES}")
        return values.get(name, 1)

    def of_field(field: Any, above: tuple[str, ...]) -> int:
        kind, detail = field
        if kind == Nodetype.NAME:
            return of_type(detail, above)
        if kind == Nodetype.BASE:
            return 1
        inner, size = detail
        return of_field(inner, above) * (size if kind == Nodetype.ARRAY else 1)

    of_type(name, ())


def installed_type(name: str) -> MessageType:
    """Message type as it is shipped or installed.

    Raises:
        BagError: it is neither.
    """
    return MessageType(name, schema_text(name).encode(), "ros2msg")


def nanoseconds(arrays: Mapping[str, NDArray[Any]], field: str) -> NDArray[np.int64]:
    """Times or durations, ns, of a field of messages that were decoded to arrays."""
    times: NDArray[np.int64] = arrays[f"{field}.sec"].astype(np.int64) * NANOSECONDS + arrays[f"{field}.nanosec"]
    return times


def _native(column: NDArray[Any]) -> NDArray[Any]:
    """Column in native byte order, text decoded."""
    if column.dtype.kind != "S":
        return np.ascontiguousarray(column, dtype=column.dtype.newbyteorder("="))
    if (column == column[0]).all():  # most text never changes, and decoding is slow
        return np.full(len(column), column[0].decode("utf-8", "replace"))
    return np.char.decode(column, "utf-8", "replace")


def _merge(parts: list[tuple[list[int], NDArray[Any]]], total: int) -> NDArray[Any]:
    """One column from those of several layouts, each with its row numbers."""
    first = parts[0][1]
    if sum(len(rows) for rows, _ in parts) == total and all(part.shape[1:] == first.shape[1:] for _, part in parts):
        if len(parts) == 1:
            return first
        column = np.empty((total, *first.shape[1:]), dtype=np.result_type(*(part for _, part in parts)))
        for rows, part in parts:
            column[rows] = part
        return column
    ragged = np.full(total, None, dtype=object)
    for rows, part in parts:
        for row, value in zip(rows, part, strict=True):
            ragged[row] = value
    return ragged
