"""Parameters that follow the plant's: its values hold for every node that is not given others.

The plant's parameter that another one follows is named in its :class:`~formation_gnc.parameters.Limits`:

- `{deputy}` is the name of the node's deputy;
- `{NAME}` of any other list of names makes a list, with one value for each of them;
- `*` makes a list of the names in its place for which the parameter is true.

Parameters that all nodes share follow those of the plant of the same name.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import MISSING
from typing import Any

from formation_gnc.common import CommonParameters
from formation_gnc.parameters import Leaf, dump, leaves
from formation_gnc.plant.parameters import PlantParameters

SHARED = frozenset(leaf.name for leaf in leaves(CommonParameters, {}))

LIST = re.compile(r"\{(\w+)\}")


def values_of_plant(given: Mapping[str, Any]) -> dict[str, Any]:
    """What a plant flies with, by dotted name: given or default, unchecked, without what is missing."""
    values = {leaf.name: given.get(leaf.name, leaf.default) for leaf in leaves(PlantParameters, given)}
    return {name: value for name, value in values.items() if value is not MISSING}


def with_followed(schema: Any, given: Mapping[str, Any], plant: Mapping[str, Any], deputy: str) -> dict[str, Any]:
    """Values of a node by dotted name: given, or else those of the plant that they follow.

    Args:
        schema: of the node's parameters.
        given: to the node.
        plant: values of the plant.
        deputy: whose node it is; empty for none.
    """
    values = {leaf.name: _followed(leaf, given, plant, deputy) for leaf in leaves(schema, given)}
    return {name: value for name, value in values.items() if value is not MISSING} | dict(given)


def departures(parameters: Any, plant: Mapping[str, Any], deputy: str) -> list[str]:
    """In words, each parameter of a node that has another value than the plant's, which it follows by default.

    Args:
        parameters: of the node.
        plant: values of the plant.
        deputy: whose node it is; empty for none.
    """
    values, found = dump(parameters), list[str]()
    for leaf in leaves(type(parameters), values):
        expected = _followed(leaf, values, plant, deputy)
        if expected is MISSING or leaf.check(expected) == values[leaf.name]:
            continue
        unit = f" {leaf.limits.unit}" if leaf.limits.unit else ""
        found.append(
            f"{leaf.name} is {_shown(values[leaf.name])}{unit}, the plant's {leader_of(leaf, deputy)} "
            f"{_shown(expected)}{unit}"
        )
    return found


def leader_of(leaf: Leaf, deputy: str) -> str:
    """Name of the plant's parameter that one follows; empty for none."""
    return leaf.limits.follows.replace("{deputy}", deputy) or (leaf.name if leaf.name in SHARED else "")


def _followed(leaf: Leaf, values: Mapping[str, Any], plant: Mapping[str, Any], deputy: str) -> Any:
    """The plant's value, within the follower's own range; MISSING where there is none."""
    leader = leader_of(leaf, deputy)
    if "*" in leader:
        return tuple(_names_on(plant, *leader.split("*"))) or MISSING
    if listed := LIST.search(leader):
        names = [LIST.sub(str(name), leader) for name in values.get(listed[1], ())]
        known = tuple(leaf.nearest(plant[name]) for name in names if name in plant)
        return known if known and len(known) == len(names) else MISSING
    return leaf.nearest(plant[leader]) if leader in plant else MISSING


def _names_on(plant: Mapping[str, Any], before: str, after: str) -> Iterator[str]:
    for name, value in plant.items():
        if value is True and name.startswith(before) and name.endswith(after):
            yield name.removeprefix(before).removesuffix(after)


def _shown(value: Any) -> str:
    return str(list(value) if isinstance(value, tuple) else value)
