"""Where the fields of a serialized (CDR) message lie."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

from formation_gnc.messages.definitions import FieldDefinition

_NUMPY = {
    "bool": "?",
    **dict.fromkeys(("byte", "char", "uint8"), "u1"),
    **{"int8": "i1", "int16": "i2", "int32": "i4", "int64": "i8"},
    **{"uint16": "u2", "uint32": "u4", "uint64": "u8", "float32": "f4", "float64": "f8"},
}
_ENCAPSULATION = 4  # bytes before the body, from which CDR aligns


class MisfitError(ValueError):
    """Bytes that are no message of the type."""


@dataclass(frozen=True)
class CdrLayout:
    """Layout of all messages of a type with the same length and the same element counts."""

    dtype: np.dtype[Any]
    """Structured type with the dotted fields at their offsets."""
    counts: struct.Struct
    """Reads all element counts of a message."""
    values: tuple[int, ...]
    """Element counts of this layout."""
    content: struct.Struct
    """Reads and writes everything but the alignment gaps."""

    def fits(self, data: bytes) -> bool:
        """Whether a message of the layout's length has its element counts."""
        return self.counts.unpack_from(data) == self.values


class LayoutBuilder:
    """Walks over the fields of one message and notes where each lies."""

    def __init__(self, definitions: Mapping[str, Sequence[FieldDefinition]], data: bytes) -> None:
        """Start before the first field.

        Args:
            definitions: fields by message type, with all nested types.
            data: the message.

        Raises:
            MisfitError: the encapsulation is not that of plain CDR.
        """
        if len(data) < _ENCAPSULATION or data[0] != 0 or data[1] > 1:
            raise MisfitError("not plain CDR")
        self._definitions, self._data = definitions, data
        self._order = "<" if data[1] else ">"
        self._fields: dict[str, tuple[Any, int]] = {}
        self._counts, self._values = f"{self._order}{_ENCAPSULATION}x", list[int]()
        self._content = f"={_ENCAPSULATION}s"
        self._position = self._counted = 0  # in the body; behind the last item, behind the last count

    def build(self, type_name: str) -> CdrLayout:
        """Layout of the message.

        Raises:
            MisfitError: the message is too short.
            KeyError: the definition of a nested type is missing.
        """
        for name, (node, detail) in self._definitions[type_name]:
            self._walk(name, node, detail)
        description = {
            "names": list(self._fields),
            "formats": [kind for kind, _ in self._fields.values()],
            "offsets": [offset for _, offset in self._fields.values()],
            "itemsize": len(self._data),
        }
        return CdrLayout(
            np.dtype(description),  # type: ignore[call-overload]
            struct.Struct(self._counts),
            tuple(self._values),
            struct.Struct(self._content),
        )

    def _walk(self, path: str, node: Nodetype, detail: Any) -> None:
        """Pass over a field, down to its nested ones."""
        if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            element, size = detail
            self._walk_elements(path, element, size if node == Nodetype.ARRAY else self._read_count())
        elif node == Nodetype.NAME:
            for name, (inner, more) in self._definitions[detail]:
                self._walk(f"{path}.{name}", inner, more)
        elif detail[0] == "string":
            length = self._read_count()
            # A string without even its terminator has no bytes: its zero count reads as one.
            self._fields[path] = (f"S{length}", self._advance(length, 1)) if length else ("S1", self._position)
        else:
            size = np.dtype(_NUMPY[detail[0]]).itemsize
            self._fields[path] = (self._order + _NUMPY[detail[0]], self._advance(size, size))

    def _walk_elements(self, path: str, element: tuple[Nodetype, Any], length: int) -> None:
        """Pass over an array: numbers as one field, anything else element by element."""
        kind = _NUMPY.get(element[1][0]) if element[0] == Nodetype.BASE else None
        if kind is None:
            for index in range(length):
                self._walk(f"{path}.{index}", *element)
            return
        item = np.dtype(kind).itemsize
        offset = self._advance(length * item, item if length else 1)
        self._fields[path] = ((self._order + kind, (length,)), offset)

    def _read_count(self) -> int:
        offset = self._advance(4, 4)
        self._counts += f"{self._position - 4 - self._counted}xI"
        self._counted = self._position
        self._values.append(int.from_bytes(self._data[offset : offset + 4], "little" if self._order == "<" else "big"))
        return self._values[-1]

    def _advance(self, size: int, align: int) -> int:
        """Pass over the next item; returns its offset in the message."""
        gap = -self._position % align
        offset = self._position + gap + _ENCAPSULATION
        self._position += gap + size
        if self._position > len(self._data) - _ENCAPSULATION:
            raise MisfitError(f"{len(self._data)} bytes are too few")
        self._content += f"{gap}x{size}s"
        return offset
