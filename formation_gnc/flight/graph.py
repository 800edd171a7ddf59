"""The graph table: the modules of every satellite, what each takes and gives.

Nodes, composed satellites, in-process runner, replay, launcher, recorder, layout and the page of topics are
read from it. A new module is its class, a row here and its executable's name in `setup.py`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pkgutil import resolve_name
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.module import FlightModule
from formation_gnc.flight.synchronizer import StampSynchronizer
from formation_gnc.flight.topics import Topic
from formation_gnc.records import Event, NavigationState


@dataclass(frozen=True)
class Input:
    """A topic that a module takes, and what it reads of its messages: the whole record, or an extract."""

    topic: Topic
    record: Any

    @classmethod
    def whole(cls, topic: Topic) -> "Input":
        """Every field of the topic's messages."""
        return cls(topic, topic.record)


@dataclass(frozen=True)
class Row:
    """A flight module of every satellite.

    name: of its node and executable, and of its parameters in a scenario.
    module_path: Python's path of its class, "package.module:Class"; imported at first use, since a process needs few.
    parameters_path: the same of the schema of its parameters.
    takes: needed at every tick, from the own satellite.
    gives: in the order in which the module returns them; the first answers the tick.
    takes_of_others: from the fleet's other satellites; dispensable, None where one is silent.
    """

    name: str
    module_path: str
    parameters_path: str
    takes: tuple[Input, ...]
    gives: tuple[Topic, ...]
    takes_of_others: tuple[Input, ...] = ()

    @cached_property
    def module(self) -> type[FlightModule[Any, Any]]:
        """Its class, called with the node's full name and its parameters."""
        found: type[FlightModule[Any, Any]] = resolve_name(self.module_path)
        return found

    @cached_property
    def parameters(self) -> Any:
        """The schema of its parameters."""
        return resolve_name(self.parameters_path)

    @property
    def answer(self) -> Topic:
        """The topic by which others know that the module has answered a tick."""
        return self.gives[0]


PLANT = "/plant"
"""Full name of the plant's node."""

NAVIGATION_STATE = Input(topics.ESTIMATE, NavigationState)

MODULES: dict[str, Row] = {}
"""The table: rows by name, in the order in which they answer within a tick."""

GRAPH = MODULES.values()
"""Its rows."""


def add_module(row: Row) -> None:
    """Add a module to every satellite; it answers after those before it.

    Raises:
        ConfigurationError: a module of that name is there already.
    """
    if row.name in MODULES:
        raise ConfigurationError(f"module {row.name}: is in the graph table already")
    MODULES[row.name] = row


for _row in (
    Row(
        "navigation",
        "formation_gnc.navigation.navigation_filter:NavigationFilter",
        "formation_gnc.navigation.parameters:NavigationParameters",
        takes=(Input.whole(topics.MEASUREMENT),),
        gives=(topics.ESTIMATE,),
    ),
    Row(
        "guidance",
        "formation_gnc.guidance.guidance:Guidance",
        "formation_gnc.guidance.parameters:GuidanceParameters",
        takes=(NAVIGATION_STATE,),
        takes_of_others=(NAVIGATION_STATE,),
        gives=(topics.TARGET, topics.SEPARATION),
    ),
    Row(
        "controller",
        "formation_gnc.control.controller_manager:ControllerManager",
        "formation_gnc.control.controller_manager:ControllerParameters",
        takes=(NAVIGATION_STATE, Input.whole(topics.TARGET)),
        gives=(topics.THRUST, topics.STATUS),
    ),
):
    add_module(_row)

COMMAND = topics.THRUST
"""What the plant waits for."""


def modules_named(names: Sequence[str]) -> tuple[Row, ...]:
    """Rows of these names, in the table's order; raises ConfigurationError for an unknown name or none."""
    unknown = [name for name in names if name not in MODULES]
    if unknown or not names:
        raise ConfigurationError(f"nodes {', '.join(unknown) or 'none'}: must be some of {', '.join(MODULES)}")
    return tuple(row for row in GRAPH if row.name in names)


class ModuleInstance:
    """A flight module of one deputy: its inputs brought together by stamp, its outputs by topic."""

    def __init__(self, row: Row, deputy: str, parameters: Any) -> None:
        """Build the module.

        Raises:
            ConfigurationError: parameters that cannot be flown.
        """
        self.row, self.deputy = row, deputy
        self.node = f"/{deputy}/{row.name}"
        self.module: FlightModule[Any, Any] = row.module(self.node, parameters)
        others = self.module.neighbours
        self.inputs = {each.topic.of(deputy): each.record for each in row.takes}
        """Record by full name of each needed topic."""
        self.inputs_of_others = {each.topic.of(name): each.record for each in row.takes_of_others for name in others}
        """The same of the dispensable ones."""
        self.outputs = tuple(topic.of(deputy) for topic in row.gives)
        self.synchronizer = StampSynchronizer((*self.inputs, *self.inputs_of_others), len(self.inputs))

    def published(self) -> Iterator[Topic]:
        """The topics that it publishes: those of a fleet only in one."""
        return (topic for topic in self.row.gives if not topic.fleet_only or self.module.neighbours)

    def collect(self, records: Mapping[str, Any]) -> Sequence[Any] | None:
        """Its inputs at a tick, of the records there are by topic; None while it cannot answer."""
        if not self.inputs_of_others:
            try:
                return [records[topic] for topic in self.inputs]
            except KeyError:
                return None
        inputs: Sequence[Any] | None = None
        for topic in (*self.inputs_of_others, *reversed(self.inputs)):  # the pacing topic last
            if topic in records:
                inputs = self.synchronizer.take(topic, records[topic])
        return inputs

    def respond(self, inputs: Sequence[Any]) -> list[tuple[str, Any]]:
        """Answer a tick: full topic name and record of each output there is."""
        answer = self.module.on_tick(*inputs)
        if not isinstance(answer, tuple):
            return [] if answer is None else [(self.outputs[0], answer)]
        return [each for each in zip(self.outputs, answer, strict=True) if each[1] is not None]

    def take_events(self) -> list[Event]:
        """The module's events since they were last taken."""
        return self.module.take_events()


def every_tick(deputy: str) -> list[str]:
    """Full names of a deputy's topics that have a message at every tick."""
    given = [topic for row in GRAPH for topic in row.gives if topic.every_tick]
    return [topic.of(deputy) for topic in (topics.MEASUREMENT, *given, topics.TIMING)]
