"""Files that come with the package, by name: scenarios and campaigns, in the source tree or where it is installed."""

import os
from collections.abc import Iterator
from pathlib import Path

import formation_gnc
from formation_gnc.errors import ConfigurationError


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
    directories = list(_directories(folder))
    for directory in directories:
        if (directory / f"{name}.yaml").is_file():
            return directory / f"{name}.yaml"
    known = sorted(path.stem for directory in directories for path in directory.glob("*.yaml"))
    raise ConfigurationError(f"{kind} {name}: unknown; it must be {form} or one of {', '.join(known)}")


def _directories(folder: str) -> Iterator[Path]:
    source = Path(formation_gnc.__file__).resolve().parents[1]
    if (source / "package.xml").is_file():
        yield source / folder
        return
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        directory = Path(prefix) / "share" / "formation_gnc" / folder
        if directory.is_dir():
            yield directory
