"""YAML of parameter files as ROS 2 reads it: its numbers, its lists of one type, nothing given twice."""

import math
import re
from typing import Any

import yaml

from formation_gnc.limited_yaml import LimitedLoader, reject

_TRUE = {"y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}
_FALSE = {"n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}
_INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_FLOAT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_HEXADECIMAL = re.compile(r"[-+]?0[xX]([0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)([pP][-+]?\d+)?")
_SPECIAL = re.compile(r"([-+]?)\.?(nan|inf|infinity)", re.IGNORECASE)


class ParameterLoader(LimitedLoader):
    """Loader that gives every value as ROS 2 would, and raises yaml.YAMLError for what ROS 2 refuses."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - the base's kind of attribute

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node; rejects aliases."""
        if self.check_event(yaml.AliasEvent):
            reject(self.peek_event().start_mark, "aliases are not allowed")  # type: ignore[no-untyped-call]
        return super().compose_node(parent, index)


def scalar(text: str) -> bool | int | float | str:
    """Value of a plain scalar: the first of truth value, integer of 64 bits, floating-point number, text."""
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if _INTEGER.fullmatch(text):
        sign, digits = (-1 if text.startswith("-") else 1), text.lstrip("+-")
        value = sign * int(digits, 8 if re.fullmatch("0[0-7]+", digits) else 0)
        if -(2**63) <= value < 2**63:
            return value
    number = _number(text)
    return text if number is None else number


def _number(text: str) -> float | None:
    """Floating-point number as C reads it; None for text, or for what overflows."""
    if special := _SPECIAL.fullmatch(text):
        return float(special[1] + special[2])
    try:
        if _FLOAT.fullmatch(text):
            value = float(text)
        elif _HEXADECIMAL.fullmatch(text):
            value = float.fromhex(text)
        else:
            return None
    except OverflowError:
        return None
    return value if math.isfinite(value) else None


def _construct_scalar(loader: ParameterLoader, node: yaml.ScalarNode) -> Any:
    return node.value if node.style else scalar(node.value)


def _construct_list(loader: ParameterLoader, node: yaml.SequenceNode) -> list[Any]:
    if not all(isinstance(item, yaml.ScalarNode) for item in node.value):
        reject(node.start_mark, "a list must hold plain values only")
    values = [loader.construct_object(item) for item in node.value]
    kinds = sorted({type(value).__name__ for value in values})
    if len(kinds) > 1:
        reject(node.start_mark, f"the values of a list must be of one type, not {' and '.join(kinds)}")
    return values


def _construct_mapping(loader: ParameterLoader, node: yaml.MappingNode) -> dict[str, Any]:
    mapping: dict[str, Any] = {}
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            reject(key.start_mark, "a name must be plain text")
        if key.value in mapping:
            reject(key.start_mark, f"{key.value} is given twice")
        mapping[key.value] = loader.construct_object(value, deep=True)
    return mapping


ParameterLoader.add_constructor("tag:yaml.org,2002:str", _construct_scalar)
ParameterLoader.add_constructor("tag:yaml.org,2002:seq", _construct_list)
ParameterLoader.add_constructor("tag:yaml.org,2002:map", _construct_mapping)
