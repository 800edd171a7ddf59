"""Records to and from plain little-endian CDR, the bytes of DDS: every number aligned to its size.

The functions of a codec are source code, generated once for its type of record, and one call of `struct`
converts all values of a message. A loop over fields would be slow in a node, which wakes for a moment every
tick with cold caches (decision 0008).
"""

import struct
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import lru_cache
from itertools import batched
from typing import Any

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.messages.fields import Field, arguments, flatten, pack_times, reject_rows, reject_size, unpack_times
from formation_gnc.messages.layout import LITTLE_ENDIAN, PackingLayout, UnpackingLayout

PACKERS = 256
"""Layouts of one type of record kept for writing, one for all counts that its messages had."""

LAYOUTS = 16
"""Layouts kept for reading messages of one length."""

_ENCODE = """
def encode(record):
    {prepare}
    try:
        return packer(({counts}))({encapsulation}, {values})
    except StructError as error:
        raise ValueError(f"{record_type}: {{error}}") from None
"""

_PACK_ELEMENT = """
def pack_{name}(record):
    {prepare}
    return ({counts}), ({values})
"""

_DECODE = """
def decode(data):
    for unpack, counts{lists} in layouts.get(len(data), ()):
        _, {targets} = unpack(data)
        if (_, {count_targets}) == counts{inner_counts_agree}:
            return record_type({arguments})
    return decode(learn(data))
"""

_NAMES: dict[str, Any] = {
    "asarray": np.asarray,
    "ndarray": np.ndarray,
    "batched": batched,
    "flatten": flatten,
    "pack_times": pack_times,
    "unpack_times": unpack_times,
    "reject_rows": reject_rows,
    "reject_size": reject_size,
    "StructError": struct.error,
}
_NAMES |= {np.dtype(code).name: np.dtype(code) for code in "?bBhHiIqQfd"}
_NAMES |= {f"each_{np.dtype(code).name}": struct.Struct(f"<{code}").iter_unpack for code in "?bBhHiIqQfd"}


class Codec[T]:
    """Converts records of one type to messages and back."""

    encode: Callable[[T], bytes]
    """Message of a record; raises ValueError for a value that the message cannot hold."""
    decode: Callable[[bytes], T]
    """Record of a message; raises ConfigurationError when the bytes do not fit the message type."""

    def __init__(
        self,
        record_type: type[T],
        message: str,
        message_fields: Sequence[Field],
        to_little_endian: Callable[[bytes], bytes],
    ) -> None:
        """Generate the functions.

        Args:
            record_type: dataclass with all fields of the message, or some of them for reading only.
            message: name of the message type.
            message_fields: all its fields in their order.
            to_little_endian: converts a message of the other byte order; raises RuntimeError or ValueError.
        """
        self._message, self._fields, self._to_little_endian = message, message_fields, to_little_endian
        self._wanted = {field.name for field in fields(record_type)}  # type: ignore[arg-type]
        self._lists = [field.name for field in message_fields if field.elements and field.name in self._wanted]
        self._has_lists = any(field.elements for field in message_fields)
        self._layouts: dict[int, list[tuple[Any, ...]]] = {}  # by number of bytes
        names = _NAMES | {
            "record_type": record_type,
            "packer": lru_cache(PACKERS)(self._packer),
            "layouts": self._layouts,
            "learn": self._learn,
        }
        names |= {f"new_{field.name}": field.elements.record_type for field in message_fields if field.elements}
        exec(compile(self._source(record_type), f"<{record_type.__name__} as CDR>", "exec"), names)
        self.encode, self.decode = names["encode"], names["decode"]

    def _source(self, record_type: type[T]) -> str:
        wanted = [field for field in self._fields if field.name in self._wanted]
        lists = [(field.name, field.elements.fields) for field in self._fields if field.elements]
        source = "".join(_PACK_ELEMENT.format(name=name, **_packing(elements)) for name, elements in lists)
        source += _ENCODE.format(
            record_type=record_type.__name__, encapsulation=LITTLE_ENDIAN, **_packing(self._fields)
        )
        return source + _DECODE.format(
            lists="".join(f", {name}" for name in self._list_variables()),
            targets="".join(field.targets if field in wanted else field.count_targets for field in self._fields),
            count_targets="".join(field.count_targets for field in self._fields),
            inner_counts_agree=" and (not inner_counts or unpack_inner(data) == inner_counts)" * self._has_lists,
            arguments=arguments(record_type, self._fields),
        )

    def _list_variables(self) -> list[str]:
        if not self._has_lists:
            return []
        return ["unpack_inner", "inner_counts", *(f"unpack_{name}" for name in self._lists)]

    def _learn(self, data: bytes) -> bytes:
        """Keep the layout of a message for all that have its length and counts.

        Returns:
            The message in little-endian order.

        Raises:
            ConfigurationError: the bytes do not fit the message type.
        """
        size = len(data)
        try:
            if not data.startswith(LITTLE_ENDIAN):
                data = self._to_little_endian(data)
            layout = UnpackingLayout(data)
            for field in self._fields:
                layout.is_wanted = field.name in self._wanted
                field.append_to(layout)
            layout.check_size()
        except (struct.error, ValueError, RuntimeError) as error:
            raise ConfigurationError(f"{size} bytes do not fit message type {self._message}: {error}") from None
        known: tuple[Any, ...] = layout.format.unpacker(), (LITTLE_ENDIAN, *layout.counts)
        if self._has_lists:
            unpackers = [layout.lists[name].unpacker() for name in self._lists]
            known += (layout.inner_format.unpacker(), tuple(layout.inner_counts), *unpackers)
        alike = self._layouts.setdefault(len(data), [])
        alike[:] = [known, *alike[: LAYOUTS - 1]]
        return data

    def _packer(self, counts: tuple[int, ...]) -> Callable[..., bytes]:
        layout = PackingLayout(counts)
        for field in self._fields:
            field.append_to(layout)
        return layout.format.packer(layout.offset)


def _packing(message_fields: Sequence[Field]) -> dict[str, str]:
    return {
        "prepare": "\n    ".join(field.prepare for field in message_fields),
        "counts": "".join(field.counts for field in message_fields),
        "values": "".join(field.values for field in message_fields),
    }
