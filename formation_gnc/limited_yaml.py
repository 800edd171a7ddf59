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


class LimitedLoader(yaml.SafeLoader):
    """Safe loader that raises RejectedYamlError for a document beyond the limits."""

    def __init__(self, stream: str) -> None:
        """Load a text."""
        if len(stream) > LARGEST:
            raise RejectedYamlError(f"{len(stream)} characters, must be at most {LARGEST}")
        super().__init__(stream)
        self._depth = self._values = 0
        self._sizes: dict[str, int] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node within the limits; an alias counts as what it stands for."""
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._sizes:
                reject(event.start_mark, f"alias *{event.anchor} is of nothing before it")
            self._add(event, self._sizes[event.anchor])
            return super().compose_node(parent, index)
        self._depth += 1
        self._add(event, 1)
        if self._depth > DEEPEST:
            reject(event.start_mark, f"nested deeper than {DEEPEST} levels")
        before = self._values
        node = super().compose_node(parent, index)
        if getattr(event, "anchor", None):
            self._sizes[event.anchor] = self._values - before + 1
        self._depth -= 1
        return node

    def _add(self, event: yaml.Event, values: int) -> None:
        self._values += values
        if self._values > MOST:
            reject(event.start_mark, f"more than {MOST} values")


def load_limited(text: str) -> Any:
    """Contents of a YAML document; raises yaml.YAMLError for none, and for one beyond the limits."""
    return yaml.load(text, Loader=LimitedLoader)
