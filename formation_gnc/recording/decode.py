"""From CDR bytes to arrays and typed messages, by the definition that the bag itself carries."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

from formation_gnc.errors import ConfigurationError
from formation_gnc.types import NANOSECONDS

_NUMPY = {
    "bool": "?",
    **dict.fromkeys(("byte", "char", "uint8"), "u1"),
    **{"int8": "i1", "int16": "i2", "int32": "i4", "int64": "i8"},
    **{"uint16": "u2", "uint32": "u4", "uint64": "u8", "float32": "f4", "float64": "f8"},
}
_ENCAPSULATION = 4  # bytes before the body, from which CDR aligns
_KNOWN_LAYOUTS = 64  # of one message length; free text has ever new ones


class MessageType:
    """A message type as its `ros2msg` schema defines it.

    Raises ConfigurationError when the definition cannot be read.
    """

    def __init__(self, name: str, schema: bytes, encoding: str) -> None:
        """Read the definition."""
        self.name = name
        if encoding != "ros2msg":
            raise ConfigurationError(f"message type {name!r}: schema encoding {encoding!r}, known is ros2msg")
        self._layouts: dict[tuple[bytes, int], list[_Layout]] = {}
        self._store = get_typestore(Stores.EMPTY)
        try:
            self._store.register(get_types_from_msg(schema.decode(), name))
            self._fields = self._store.fielddefs[name][1]
        except (TypesysError, UnicodeDecodeError, KeyError, ValueError) as error:
            raise ConfigurationError(f"message type {name!r}: its schema cannot be read: {error}") from None

    def is_laid_out_as(self, other: "MessageType") -> bool:
        """Whether both have the same fields, down to the last nested one; names of constants do not count."""

        def fields(kind: "MessageType") -> dict[str, Any]:
            return {name: definition[1] for name, definition in kind._store.fielddefs.items()}

        return self.name == other.name and fields(self) == fields(other)

    def canonical(self, data: bytes) -> bytes:
        """Serialised message with zeros for what carries no information.

        ROS leaves the alignment gaps as the memory happened to be, and `serialize_message` may append more
        of it; two messages with the same fields have the same canonical bytes.
        Raises ConfigurationError when the bytes do not fit the type.
        """
        content = self._layout(data).content
        return content.pack(*content.unpack_from(data))

    def message(self, data: bytes) -> Any:
        """Decode one message: an object with the fields as attributes, arrays as NumPy arrays.

        Raises ConfigurationError when the bytes do not fit the type.
        """
        try:
            return self._store.deserialize_cdr(self.canonical(data), self.name)
        except (SerdeError, KeyError) as error:
            raise self._misfit(str(error)) from None

    def arrays(self, messages: Sequence[bytes]) -> dict[str, NDArray[Any]]:
        """Decode many messages of the type at once: one array per field, a row per message.

        Nested fields are dotted, elements of message and string arrays numbered ("deputies.0.mass");
        number arrays are stacked to shape (n, length). Where length or presence differs between messages the
        column has dtype object: an array or value per message, None where there is none.
        Raises ConfigurationError when the bytes do not fit the type.
        """
        alike: dict[int, tuple[_Layout, list[int]]] = {}
        for row, data in enumerate(messages):
            layout = self._layout(data)
            alike.setdefault(id(layout), (layout, []))[1].append(row)
        columns: dict[str, list[tuple[list[int], NDArray[Any]]]] = {}
        for layout, rows in alike.values():
            records = np.frombuffer(b"".join([messages[row] for row in rows]), layout.dtype)
            for field in layout.dtype.names or ():
                columns.setdefault(field, []).append((rows, _native(records[field])))
        return {field: _gather(parts, len(messages)) for field, parts in columns.items()}

    def _layout(self, data: bytes) -> "_Layout":
        """Layout that the message has: a known one whose counts it shares, or a new one."""
        known = self._layouts.setdefault((data[:2], len(data)), [])
        for layout in known:
            if layout.counts.unpack_from(data) == layout.values:
                return layout
        if len(known) >= _KNOWN_LAYOUTS:
            known.clear()
        known.append(self._new_layout(data))
        return known[-1]

    def _new_layout(self, data: bytes) -> "_Layout":
        if len(data) < _ENCAPSULATION or data[0] != 0 or data[1] > 1:
            raise self._misfit("not plain CDR")
        order = "<" if data[1] else ">"
        fields: dict[str, tuple[Any, int]] = {}
        counts, values = f"{order}{_ENCAPSULATION}x", []
        content = f"={_ENCAPSULATION}s"
        position = counted = 0

        def advance(size: int, align: int) -> int:
            """Pass over the next item; its offset in the message."""
            nonlocal position, content
            gap = -position % align
            offset = position + gap + _ENCAPSULATION
            position += gap + size
            if position > len(data) - _ENCAPSULATION:
                raise self._misfit(f"{len(data)} bytes are too few")
            content += f"{gap}x{size}s"
            return offset

        def count() -> int:
            nonlocal counted, counts
            offset = advance(4, 4)
            counts += f"{position - 4 - counted}xI"
            counted = position
            values.append(int.from_bytes(data[offset : offset + 4], "little" if order == "<" else "big"))
            return values[-1]

        def walk(path: str, node: Nodetype, detail: Any) -> None:
            if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                element, size = detail
                length = size if node == Nodetype.ARRAY else count()
                kind = _NUMPY.get(element[1][0]) if element[0] == Nodetype.BASE else None
                if kind is not None:
                    item = np.dtype(kind).itemsize
                    fields[path] = ((order + kind, (length,)), advance(length * item, item if length else 1))
                else:
                    for index in range(length):
                        walk(f"{path}.{index}", *element)
            elif node == Nodetype.NAME:
                for name, (inner, more) in self._store.fielddefs[detail][1]:
                    walk(f"{path}.{name}", inner, more)
            elif detail[0] == "string":
                length = count()
                # A string without even its terminator has no bytes: its zero count reads as one.
                fields[path] = (f"S{length}", advance(length, 1)) if length else ("S1", position)
            else:
                size = np.dtype(_NUMPY[detail[0]]).itemsize
                fields[path] = (order + _NUMPY[detail[0]], advance(size, size))

        try:
            for name, (node, detail) in self._fields:
                walk(name, node, detail)
        except KeyError as error:
            raise ConfigurationError(f"message type {self.name!r}: its schema lacks {error}") from None
        formats, offsets = zip(*fields.values(), strict=True)
        dtype = np.dtype(
            {"names": list(fields), "formats": formats, "offsets": offsets, "itemsize": len(data)}  # type: ignore[call-overload]
        )
        return _Layout(dtype, struct.Struct(counts), tuple(values), struct.Struct(content))

    def _misfit(self, reason: str) -> ConfigurationError:
        return ConfigurationError(f"message type {self.name!r}: a message does not fit it: {reason}")


def installed_type(name: str) -> MessageType:
    """Message type as the installed message packages define it.

    Raises ConfigurationError when it is not installed.
    """
    from formation_gnc.recording.schema import schema_text  # here alone, so that reading a bag needs no ROS

    return MessageType(name, schema_text(name).encode(), "ros2msg")


def nanoseconds(arrays: Mapping[str, NDArray[Any]], field: str) -> NDArray[np.int64]:
    """Times or durations of a field in what `MessageType.arrays` returns, ns."""
    times: NDArray[np.int64] = arrays[f"{field}.sec"].astype(np.int64) * NANOSECONDS + arrays[f"{field}.nanosec"]
    return times


@dataclass(frozen=True)
class _Layout:
    """Where the fields of a message lie, for all messages with the same element counts in them."""

    dtype: np.dtype[Any]
    counts: struct.Struct  # reads all counts, which are `values`
    values: tuple[int, ...]
    content: struct.Struct  # everything but the alignment gaps


def _native(column: NDArray[Any]) -> NDArray[Any]:
    if column.dtype.kind == "S":
        return np.char.decode(column, "utf-8", "replace")
    return np.ascontiguousarray(column, dtype=column.dtype.newbyteorder("="))


def _gather(parts: list[tuple[list[int], NDArray[Any]]], total: int) -> NDArray[Any]:
    """Put the rows of several groups back in their order."""
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
