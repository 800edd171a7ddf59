"""Plug-ins: what installed packages add to the registries, by entry points.

A distribution declares an entry point in the group of a registry, as
`[project.entry-points."formation_gnc.laws"]` with `pd = "own_law:ProportionalDerivative"`. Registries take their
plug-ins in when they are imported, so that those join schemas, compiled kernels and the reference page as the
built-in entries do.
"""

from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from formation_gnc.errors import ConfigurationError

KINDS = "laws", "formations", "sensors", "forces", "models", "monitors", "figures"

GROUPS = tuple(f"formation_gnc.{kind}" for kind in KINDS)
"""Groups of entry points, one for each open registry."""


@cache
def _declared() -> tuple[EntryPoint, ...]:
    """Entry points of all groups, in order of name, so that no order of installation reaches a result."""
    found = {(each.group, each.name, each.value): each for each in entry_points() if each.group in GROUPS}
    return tuple(found[key] for key in sorted(found))


def load_plugins(kind: str, base: type, taken: Iterable[str]) -> Iterator[tuple[str, Any]]:
    """Plug-ins of a registry by name, in order of name.

    Args:
        kind: of registry, as in its group `formation_gnc.KIND`.
        base: what each must be a subclass or an instance of.
        taken: names of the built-in entries.

    Raises:
        ConfigurationError: one cannot be imported, is no `base`, or has a name that is taken or is not the entry's.
    """
    names = set(taken)
    for entry in _declared():
        if entry.group != f"formation_gnc.{kind}":
            continue
        who = f"plug-in {entry.name} ({entry.value}{_owner(entry)})"
        if entry.name in names:
            raise ConfigurationError(f"{who}: the name is taken in {entry.group}; choose another")
        names.add(entry.name)
        try:
            plugin = entry.load()
        except Exception as error:  # whatever a stranger's module raises
            raise ConfigurationError(f"{who}: cannot be imported: {type(error).__name__}: {error}") from error
        if not (issubclass(plugin, base) if isinstance(plugin, type) else isinstance(plugin, base)):
            raise ConfigurationError(f"{who}: must be a {base.__module__}.{base.__qualname__}")
        if (name := getattr(plugin, "name", entry.name)) != entry.name:
            raise ConfigurationError(f"{who}: its name is {name!r}; both must be the same")
        yield entry.name, plugin


def plugin_versions() -> dict[str, str]:
    """Versions of the distributions that bring plug-ins, by name."""
    return {each.dist.name: each.dist.version for each in _declared() if each.dist}


def _owner(entry: EntryPoint) -> str:
    return f" of {entry.dist.name} {entry.dist.version}" if entry.dist else ""
