"""Files that come with the package, by name: scenarios, campaigns and message definitions.

They are in the source tree, in the package itself where a wheel brought it, or where colcon installed them.
"""

import os
from collections.abc import Iterator
from pathlib import Path

import formation_gnc
from formation_gnc.errors import ConfigurationError

MESSAGES = "formation_gnc_msgs"
"""Package of the project's own message types."""

_PACKAGE = Path(formation_gnc.__file__).resolve().parent
_SOURCE = _PACKAGE.parent
_WHEEL = _PACKAGE / "share"


def find_shipped(name: str, kind: str, folder: str, form: str) -> Path:
    """Path of a YAML file, given its name in a shipped folder, or its path.

    Args:
        name: without suffix for a shipped one; a suffix or a slash makes it a path.
        kind: what it is, for errors.
        folder: of the shipped ones.
        form: what a path must lead to, for errors.

    Raises:
        ConfigurationError: no such file.
    """
    if name.endswith((".yaml", ".yml")) or "/" in name:
        path = Path(name)
        if not path.is_file():
            raise ConfigurationError(f"{kind} {name}: no such file")
        return path
    directories = [_SOURCE / folder] if is_source_tree() else [share / "formation_gnc" / folder for share in _shares()]
    for directory in directories:
        if (directory / f"{name}.yaml").is_file():
            return directory / f"{name}.yaml"
    known = sorted(path.stem for directory in directories for path in directory.glob("*.yaml"))
    raise ConfigurationError(f"{kind} {name}: unknown; it must be {form} or one of {', '.join(known)}")


def find_message(package: str, name: str) -> Path | None:
    """Path of a message definition; None where it is neither shipped nor installed.

    Args:
        package: such as "std_msgs".
        name: such as "Header".
    """
    source = _SOURCE / "msg_defs"
    of_source = [source if package == MESSAGES else source / "standard" / package] if is_source_tree() else []
    for directory in [*of_source, *(share / package for share in _shares())]:
        if (directory / "msg" / f"{name}.msg").is_file():
            return directory / "msg" / f"{name}.msg"
    return None


def is_source_tree() -> bool:
    """Whether the package is imported from its source tree, or by a link to it."""
    return (_SOURCE / "package.xml").is_file()


def _shares() -> Iterator[Path]:
    """What a ROS prefix calls `share`: the wheel's, then those that are sourced."""
    if _WHEEL.is_dir():
        yield _WHEEL
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        yield Path(prefix) / "share"
