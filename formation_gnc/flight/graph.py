"""The graph table: the modules of every satellite, what each takes and gives.

Nodes, composed satellites, in-process runner, replay, launcher, recorder, layout and the page of topics are
read from it. A new module is its class, a row here and its executable's name in `setup.py`.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pkgutil import resolve_name
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.module import FlightModule
from formation_gnc.flight.synchronizer import InputTopics, StampSynchronizer
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
    takes_of_before: of the tick before, from the own satellite; dispensable, None where there is none.
    takes_of_others: from the fleet's other satellites; dispensable, None where one is silent.

    A module is given its inputs in this order: `takes`, `takes_of_before`, `takes_of_others`.
    """

    name: str
    module_path: str
    parameters_path: str
    takes: tuple[Input, ...]
    gives: tuple[Topic, ...]
    takes_of_before: tuple[Input, ...] = ()
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


PLANT, RECORDER, DISPLAY = "/plant", "/recorder", "/display"
"""Full names of the nodes of a run, of which there is one."""

NAVIGATION_STATE = Input(topics.ESTIMATE, NavigationState)
MODE = Input.whole(topics.MODE)

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
        takes_of_before=(MODE,),
        gives=(topics.ESTIMATE,),
    ),
    Row(
        "guidance",
        "formation_gnc.guidance.guidance:Guidance",
        "formation_gnc.guidance.parameters:GuidanceParameters",
        takes=(NAVIGATION_STATE,),
        takes_of_before=(MODE,),
        takes_of_others=(NAVIGATION_STATE,),
        gives=(topics.TARGET, topics.SEPARATION),
    ),
    Row(
        "controller",
        "formation_gnc.control.controller_manager:ControllerManager",
        "formation_gnc.control.controller_manager:ControllerParameters",
        takes=(NAVIGATION_STATE, Input.whole(topics.TARGET)),
        takes_of_before=(MODE,),
        gives=(topics.THRUST, topics.STATUS),
    ),
    Row(
        "supervisor",
        "formation_gnc.supervision.supervisor:Supervisor",
        "formation_gnc.supervision.parameters:SupervisorParameters",
        takes=(Input.whole(topics.MEASUREMENT),),
        takes_of_before=tuple(map(Input.whole, (topics.ESTIMATE, topics.TARGET, topics.STATUS, topics.THRUST))),
        gives=(topics.MODE, topics.HEALTH),
    ),
):
    add_module(_row)

COMMAND = topics.THRUST
"""What the plant waits for."""


def commanding() -> tuple[Row, ...]:
    """Rows without whose answer of a tick there is no command, and the tick is missed."""
    found, wanted = list[Row](), {COMMAND}
    for row in reversed(GRAPH):
        if wanted.intersection(row.gives):
            found.append(row)
            wanted.update(each.topic for each in row.takes)
    return tuple(reversed(found))


def modules_named(names: Sequence[str]) -> tuple[Row, ...]:
    """Rows of these names, in the table's order; raises ConfigurationError for an unknown name or none."""
    unknown = [name for name in names if name not in MODULES]
    if unknown or not names:
        raise ConfigurationError(f"nodes {', '.join(unknown) or 'none'}: must be some of {', '.join(MODULES)}")
    return tuple(row for row in GRAPH if row.name in names)


class ModuleInstance:
    """A flight module of one deputy: its inputs brought together by stamp, its outputs by topic."""

    def __init__(self, row: Row, deputy: str, parameters: Any, without: Collection[str] = ()) -> None:
        """Build the module.

        without: full names of dispensable topics that nobody publishes, and that are not waited for.

        Raises:
            ConfigurationError: parameters that cannot be flown.
        """
        self.row, self.deputy = row, deputy
        self.node = f"/{deputy}/{row.name}"
        self.module: FlightModule[Any, Any] = row.module(self.node, parameters)
        needed = {each.topic.of(deputy): each.record for each in row.takes}
        delayed = {each.topic.of(deputy): each.record for each in row.takes_of_before}
        others = {each.topic.of(name): each.record for each in row.takes_of_others for name in self.module.neighbours}
        self.inputs = needed | delayed | others
        """Record by full name of each topic that it takes."""
        self.needed = tuple(needed)
        """Full names of those that it cannot answer without."""
        self.delayed = frozenset(delayed)
        """Full names of those of the tick before."""
        self.outputs = tuple(topic.of(deputy) for topic in row.gives)
        self.synchronizer = StampSynchronizer(
            InputTopics(
                self.needed,
                tuple(delayed),
                tuple(others),
                self.module.parameters.tick_ns,
                self.module.has_delayed_inputs,
                frozenset(without),
                may_lag=row not in commanding(),  # the plant waits for the others within the tick
            )
        )

    def published(self) -> Iterator[Topic]:
        """The topics that it publishes: those of a fleet only in one."""
        return (topic for topic in self.row.gives if not topic.fleet_only or self.module.neighbours)

    def collect(
        self, records: Mapping[str, Any], before: Mapping[str, Any], missing: Sequence[int] | None = None
    ) -> Sequence[Any] | None:
        """Its inputs at a tick, of the records that there are by topic, and of the tick before; None for no answer.

        missing: places of those that it is known to have answered without.
        """
        return self.synchronizer.take_tick(records, before, missing)

    def respond(self, inputs: Sequence[Any]) -> list[tuple[str, Any]]:
        """Answer a tick: full topic name and record of each output there is."""
        answer = self.module.on_tick(*inputs)
        if not isinstance(answer, tuple):
            return [] if answer is None else [(self.outputs[0], answer)]
        return [each for each in zip(self.outputs, answer, strict=True) if each[1] is not None]

    def take_events(self) -> list[Event]:
        """The module's events since they were last taken."""
        return self.module.take_events()


def missing(inputs: Sequence[Any]) -> list[int]:
    """Places of the inputs of a tick that a module does without."""
    return [place for place, each in enumerate(inputs) if each is None] if None in inputs else []


def every_tick(deputy: str) -> list[str]:
    """Full names of a deputy's topics that have a message at every tick."""
    given = [topic for row in GRAPH for topic in row.gives if topic.every_tick]
    return [topic.of(deputy) for topic in (topics.MEASUREMENT, *given, topics.TIMING)]
