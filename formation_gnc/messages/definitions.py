"""Message definitions as rosbag2 stores them, from the shipped or installed `.msg` files."""

import re
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

from formation_gnc.errors import BagError
from formation_gnc.shipped import find_message

FieldDefinition = tuple[str, tuple[Nodetype, Any]]
"""Name of a field and its type, as rosbags parses it."""

_TYPE_NAME = re.compile(r"([A-Za-z][A-Za-z0-9_]*)/msg/([A-Za-z][A-Za-z0-9_]*)")
_FIELD_TYPE = re.compile(r"(?:^|\n)\s*([A-Za-z0-9_/]+)(?:\[[^\]]*\])?\s+")  # as rosbag2 finds dependencies
_PRIMITIVES = {
    *("bool", "byte", "char", "float32", "float64", "string", "wstring"),
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
}
_DELIMITER = "\n" + "=" * 80 + "\nMSG: "


def schema_text(type_name: str) -> str:
    """Full definition of a message type in rosbag2's `ros2msg` form.

    The raw .msg file, then every nested type once, depth first, siblings in alphabetical order, each headed
    by a line of 80 '=' and `MSG: package/Type`.

    Args:
        type_name: such as "std_msgs/msg/Header".

    Raises:
        BagError: the name is malformed or there is no such definition.
    """
    seen: set[str] = set()

    def parts(name: str) -> Iterator[str]:
        text = _definition(name)
        yield text
        package = name.partition("/")[0]
        types = {match[1] for match in _FIELD_TYPE.finditer(text)} - _PRIMITIVES
        for dependency in sorted(found if "/" in found else f"{package}/{found}" for found in types):
            if dependency not in seen:
                seen.add(dependency)
                yield _DELIMITER + dependency + "\n"
                yield from parts(dependency.replace("/", "/msg/"))

    return "".join(parts(type_name))


def type_hash(type_name: str) -> str:
    """RIHS01 hash of a message type.

    Raises:
        BagError: the name is malformed or there is no such definition.
    """
    return str(_store(type_name).hash_rihs01(type_name))


@cache
def field_definitions(type_name: str) -> Sequence[FieldDefinition]:
    """Fields of a message type; those that are nested in it, by their types' names.

    Raises:
        BagError: the name is malformed or there is no such definition.
    """
    (_, fields) = _parsed(_definition(type_name), type_name)[type_name]
    return tuple(fields)


def to_little_endian(type_name: str, data: bytes) -> bytes:
    """A message of plain CDR in little-endian order.

    Raises:
        ValueError: the bytes do not fit the type.
    """
    store = _store(type_name)
    try:
        return bytes(store.serialize_cdr(store.deserialize_cdr(data, type_name), type_name, little_endian=True))
    except Exception as error:  # rosbags' generated code checks some sizes, and leaves others to struct and NumPy
        raise ValueError(str(error)) from None


@cache
def _store(type_name: str) -> Any:
    """The type and all that are nested in it, as rosbags holds them."""
    store = get_typestore(Stores.EMPTY)
    store.register(_parsed(schema_text(type_name), type_name))
    return store


def _parsed(text: str, type_name: str) -> Any:
    try:
        return get_types_from_msg(text, type_name)
    except TypesysError as error:
        raise BagError(f"message type {type_name!r}: its definition cannot be read: {error}") from None


def _definition(type_name: str) -> str:
    """Contents of the `.msg` file of a type."""
    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise BagError(f"message type {type_name!r}: not of the form package/msg/Type")
    path = find_message(*match.groups())
    if path is None:
        package, name = match.groups()
        raise BagError(
            f"message type {type_name!r}: no {package}/msg/{name}.msg on AMENT_PREFIX_PATH, source its setup script"
        )
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise BagError(f"message type {type_name!r}: cannot read {path}: {error.strerror}") from None
