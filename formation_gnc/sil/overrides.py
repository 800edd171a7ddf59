"""Parameters given beside a scenario: `NODE.PARAMETER=VALUE`, the value as in a parameter file."""

from collections.abc import Iterable
from typing import Any

import yaml

from formation_gnc.errors import ConfigurationError, nearest
from formation_gnc.flight.graph import MODULES
from formation_gnc.parameters import read_yaml
from formation_gnc.sil.following import SHARED

FORM = "NODE.PARAMETER=VALUE, as controller.algorithm=mpc"


def overrides_of(entries: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Values by node pattern and dotted name, those of all deputies before those of one.

    NODE is `plant`, the name of a module for that of every deputy, `DEPUTY/MODULE`, or a pattern that begins
    with a slash, as in a parameter file. What all nodes share is set for all of them with `plant`. A value given
    twice is the later one.

    Raises:
        ConfigurationError: an entry has another form, an unknown node or no YAML value.
    """
    overrides: dict[str, dict[str, Any]] = {}
    for entry in entries:
        target, equals, text = entry.partition("=")
        if not equals:
            raise ConfigurationError(f"set {entry!r}: is not allowed; it must be like {FORM}")
        pattern, name = address_of(target.strip(), f"set {entry!r}")
        overrides.setdefault(pattern, {})[name] = parse_value(name, text)
    return dict(sorted(overrides.items(), key=lambda item: "*" not in item[0]))


def address_of(target: str, source: str) -> tuple[str, str]:
    """Node pattern and dotted name of a parameter given as `NODE.PARAMETER`, with NODE as for `overrides_of`.

    Raises:
        ConfigurationError: another form or an unknown node; it names the source.
    """
    node, dot, name = target.partition(".")
    if not (dot and node and name):
        raise ConfigurationError(f"{source}: is not allowed; it must be like {FORM}")
    return "/**" if node == "plant" and name in SHARED else _pattern(node, source), name


def parse_value(name: str, text: str) -> Any:
    """A value as a parameter file has it; raises ConfigurationError for none."""
    try:
        value = read_yaml(text)
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigurationError(f"parameter {name}: {text!r} is not YAML ({' '.join(str(error).split())})") from None
    if value is None or isinstance(value, dict):
        raise ConfigurationError(f"parameter {name}: {text!r} is not allowed; it must be a value or a list of them")
    return value


def _pattern(node: str, source: str) -> str:
    """Pattern of a parameter file for a node as given."""
    if node.startswith("/"):
        return node
    deputy, slash, module = node.rpartition("/")
    known = MODULES if slash else ("plant", *MODULES)
    if module not in known:
        raise ConfigurationError(f"{source}: node {node} is unknown; {nearest(module, known)}")
    if module == "plant":
        return "/plant"
    return f"/{deputy}/{module}" if slash else f"/**/{module}"
