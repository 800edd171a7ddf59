"""Message definitions as rosbag2 stores them, from the installed message packages."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

from formation_gnc.errors import BagError

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
        BagError: the name is malformed or a definition is not installed.
    """
    seen: set[str] = set()

    def parts(name: str) -> Iterator[str]:
        text = _installed(name, ".msg")
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
    """RIHS01 hash of a message type, from its installed type description.

    Raises:
        BagError: the name is malformed or the type is not installed.
    """
    hashes = json.loads(_installed(type_name, ".json"))["type_hashes"]
    return next(str(entry["hash_string"]) for entry in hashes if entry["type_name"] == type_name)


def _installed(type_name: str, suffix: str) -> str:
    """Contents of a file of the installed message package."""
    from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise BagError(f"message type {type_name!r}: not of the form package/msg/Type")
    package, name = match.groups()
    try:
        share = Path(get_package_share_directory(package))
    except (PackageNotFoundError, OSError):  # OSError: AMENT_PREFIX_PATH is not set
        raise BagError(
            f"message type {type_name!r}: package {package!r} is not on AMENT_PREFIX_PATH, source its setup script"
        ) from None
    path = share / "msg" / (name + suffix)
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise BagError(f"message type {type_name!r}: cannot read {path}: {error.strerror}") from None
