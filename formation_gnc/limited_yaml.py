"""YAML from anywhere: bounded in size, depth and what its aliases stand for, so that no text takes seconds."""

from typing import Any, NoReturn

import yaml

LARGEST, DEEPEST, MOST = 1_000_000, 32, 50_000
"""Most characters, levels and values of a document: a hundred times those of a fleet's scenario."""


class RejectedYamlError(yaml.YAMLError):
    """Valid YAML that is refused, with its line."""


def reject(mark: Any, reason: str) -> NoReturn:
    """Raise RejectedYamlError for what begins at a mark."""
    raise RejectedYamlError(f"line {mark.line + 1}: {reason}")


def check_limits(text: str) -> None:
    """Raise RejectedYamlError for a document beyond the limits; an alias counts as what it stands for."""
    if len(text) > LARGEST:
        raise RejectedYamlError(f"{len(text)} characters, must be at most {LARGEST}")
    values, open_nodes, sizes = 0, list[tuple[str | None, int]](), dict[str, int]()
    for event in yaml.parse(text, Loader=_C_LOADER):  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                reject(event.start_mark, f"alias *{event.anchor} is of nothing before it")
            values += sizes[event.anchor]
        elif isinstance(event, yaml.NodeEvent):
            values += 1
            open_nodes.append((event.anchor, values))
            if len(open_nodes) > DEEPEST:
                reject(event.start_mark, f"nested deeper than {DEEPEST} levels")
        if isinstance(event, yaml.ScalarEvent | yaml.CollectionEndEvent):
            anchor, first = open_nodes.pop()
            if anchor is not None:
                sizes[anchor] = values - first + 1
        if values > MOST:
            reject(event.start_mark, f"more than {MOST} values")


class _Limited:
    def __init__(self, stream: str) -> None:
        check_limits(stream)
        super().__init__(stream)  # type: ignore[call-arg]


class LimitedLoader(_Limited, yaml.SafeLoader):
    """Safe loader that raises RejectedYamlError for a document beyond the limits."""


_C_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # several times as fast


class _FastLoader(_Limited, _C_LOADER):  # type: ignore[misc, valid-type]
    pass


def load_limited(text: str) -> Any:
    """Contents of a YAML document; raises yaml.YAMLError for none, and for one beyond the limits."""
    return yaml.load(text, Loader=_FastLoader)
