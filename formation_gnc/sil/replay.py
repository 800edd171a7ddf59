"""Runs recorded inputs through modules again: the same parameters give the recorded outputs, bit for bit.

What flew is taken from the bag alone. Parameters are its metadata records `parameters NODE`; changes in flight
are either scheduled there, or are the `/events` of kind PARAMETERS and are committed again at their tick (those of
kinds ASSIGNMENT and MODE come about by themselves). A module is given an input only where it was given it in the
recorded run, as its `timing` records; one that had been started again, whose messages are numbered from 1 again, is
here too, with the parameters that it was started with then, `parameters NODE from STAMP`
(:mod:`formation_gnc.sil.starts`).

The truth is recorded, not flown: changed modules say what they would have commanded, and nothing answers them.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES, ModuleInstance, Row, missing
from formation_gnc.parameters import dump, load, to_json
from formation_gnc.recording.reader import Bag
from formation_gnc.records import EstimateStatus, Event, EventKind, Timing
from formation_gnc.sil.simulation import Sink
from formation_gnc.sil.starts import Decode, Start, node_name, parsed, timed_node
from formation_gnc.types import NANOSECONDS

Copy = Callable[[str, bytes, int], None]
"""Takes what was recorded and is not replayed: topic, CDR bytes, stamp in ns."""


class ReplayedModule:
    """One module, run again; started again where it had been in the recorded run."""

    def __init__(self, node: str, starts: Sequence[Start], without: Collection[str] = ()) -> None:
        """Build it as it was first started; raises ConfigurationError for what cannot be flown.

        Args:
            node: its full name.
            starts: its starts in the recorded run, sorted.
            without: full names of dispensable topics that neither the bag nor the replay has.
        """
        self.without = without
        self.node, self.deputy = node, topics.deputy_of(node)
        self.row: Row = MODULES[node_name(node)]
        self.starts: dict[int, Any] = {}
        """Parameters by the stamps of the first ticks of its processes."""
        for start in starts:
            if start.values or not self.starts:
                latest = load(self.row.parameters, start.values)
            self.starts[start.stamp] = latest
        self.answer, self.timing = self.row.answer.of(self.deputy), topics.TIMING.of(self.deputy)
        self.orphans = 0
        """Ticks whose input the bag lacks though it was answered."""
        self.unheard: tuple[int, Sequence[Any], Sequence[Event]] | None = None
        """Stamp, inputs and swaps of the last tick of which the bag has no answer, though it could have given one."""
        self._was_given_input = True
        self.start(self.starts.pop(starts[0].stamp))

    def start(self, parameters: Any) -> None:
        """Start as a process with these parameters does."""
        self.parameters = parameters
        self.instance = ModuleInstance(self.row, self.deputy, parameters, self.without)

    def is_given_input(self, stamp: int, was_given: bool, recorded: Any) -> bool:
        """Whether it gets a tick's input; starts it again where it had been.

        Args:
            stamp: of the tick, ns.
            was_given: whether it was in the recorded run.
            recorded: its answer in that run, if there is one.
        """
        acquired = getattr(recorded, "status", None) == EstimateStatus.ACQUIRED
        if was_given and (stamp in self.starts or (acquired and not self._was_given_input)):
            self.start(self.starts.get(stamp, self.parameters))
        self._was_given_input = was_given
        return was_given

    def respond(self, stamp: int, inputs: Sequence[Any], swaps: Sequence[Event]) -> list[tuple[str, Any]]:
        """Outputs by topic at a tick on which `swaps` of parameters were recorded."""
        module = self.instance.module
        due = module.scheduled_changes(stamp)
        for swap in _in_order(swaps, module.parameters):
            changes = {each.name: each.new_value for each in swap.changes}
            if changes in due:
                due.remove(changes)  # the schedule brings it about by itself
            else:
                words = f"{swap.node}: a change recorded at tick {swap.tick} is"
                module.commit(module.stage(parsed(changes, words)))
        return self.instance.respond(inputs)

    def answer_unheard(self, stamp: int) -> dict[str, Any]:
        """Outputs by topic at a tick of which the bag has none: a killed process may have reached others with them."""
        if self.unheard is None or self.unheard[0] != stamp:
            return {}
        unheard, self.unheard = self.unheard, None
        outputs = dict(self.respond(*unheard))
        self.instance.take_events()
        return outputs


def _in_order(swaps: Sequence[Event], parameters: Any) -> Iterator[Event]:
    """Changes of one tick in the order in which they were made: each begins with what those before it left."""
    values, waiting = {name: to_json(value) for name, value in dump(parameters).items()}, list(swaps)
    while waiting:
        follows = (all(values.get(one.name) == one.old_value for one in each.changes) for each in waiting)
        place = next((place for place, fits in enumerate(follows) if fits), 0)
        swap = waiting.pop(place)
        values |= {one.name: one.new_value for one in swap.changes}
        yield swap


def has_flown(bag: Bag, node: str) -> bool:
    """Whether a bag has any output of a node."""
    outputs = (topic.of(topics.deputy_of(node)) for topic in MODULES[node_name(node)].gives)
    return any(topic in bag.topics and bag.topics[topic].count for topic in outputs)


def replay(
    bag: Bag,
    starts: Mapping[str, Sequence[Start]],
    decode: Decode,
    sink: Sink,
    copy: Copy,
) -> list[str]:
    """Run a bag's inputs through modules again, tick by tick.

    Args:
        bag: the recorded run.
        starts: of every node to replay, by full name, in the order of `nodes_of`.
        decode: makes records of messages.
        sink: takes topic and record of all that the modules publish.
        copy: takes every other message as it was recorded, sorted by stamp.

    Returns:
        What could not be replayed as it was, in words.

    Raises:
        ConfigurationError: parameters that cannot be flown, or a recorded change that these do not allow.
    """
    modules, remarks = [], []
    given = {name for name, topic in bag.topics.items() if topic.count}
    given |= {topic.of(topics.deputy_of(node)) for node in starts for topic in MODULES[node_name(node)].gives}
    for node, own in starts.items():
        without = {each.topic.of(topics.deputy_of(node)) for each in MODULES[node_name(node)].takes_of_before} - given
        if not own[0].values:
            raise ConfigurationError(f"{bag.path}: has no parameters of {node}; give them in a file")
        try:
            module = ReplayedModule(node, own, without)
        except ConfigurationError as error:
            raise ConfigurationError(f"{node}: {error}") from None
        modules.append(module)
        remarks += [
            f"{node} was started again at {start.answer / NANOSECONDS:g} s; the bag lacks with which parameters, so it "
            "flies with those before"
            for start in own
            if start.answer is not None and not start.values
        ]
    _Replay(bag, modules, decode, sink, copy).run()
    orphans = sum(module.orphans for module in modules)
    if orphans:
        remarks.append(f"{orphans} answers as recorded, not flown: the bag lacks what they answer")
    return remarks


@dataclass
class _RecordedTick:
    """Recorded messages of one stamp by topic, and what they contain of the replayed modules."""

    stamp: int
    messages: dict[str, list[bytes]] = field(default_factory=dict)
    swaps: dict[str, list[Event]] = field(default_factory=dict)
    """Changes of parameters by node."""
    timed: dict[str, list[int]] = field(default_factory=dict)
    """Nodes that finished the tick, each with the places of the inputs that it had to do without."""


class _Replay:
    def __init__(self, bag: Bag, modules: Sequence[ReplayedModule], decode: Decode, sink: Sink, copy: Copy) -> None:
        self._bag, self._modules, self._decode, self._sink, self._copy = bag, modules, decode, sink, copy
        self._nodes = {module.node for module in modules}
        self._outputs = {topic: module for module in modules for topic in module.instance.outputs}
        self._before: tuple[_RecordedTick, dict[str, Any]] = (_RecordedTick(-1), {})
        """The tick before, and what was replayed of it, by topic."""
        self._timings = {name for name, topic in bag.topics.items() if topic.count and _is_timing(name)}

    def run(self) -> None:
        """Replay tick by tick."""
        tick: _RecordedTick | None = None
        for stamp, topic, messages in self._bag.by_stamp(list(self._bag.topics)):
            if tick is None or stamp != tick.stamp:
                if tick is not None:
                    self._replay_tick(tick)
                tick = _RecordedTick(stamp)
            tick.messages[topic] = messages
        if tick is not None:
            self._replay_tick(tick)

    def _replay_tick(self, tick: _RecordedTick) -> None:
        for topic, messages in tick.messages.items():
            for data in messages:
                if not self._is_replaced(tick, topic, data):
                    self._copy(topic, data, tick.stamp)
        records: dict[str, Any] = {}
        for module in self._modules:
            if topics.MEASUREMENT.of(module.deputy) in tick.messages:
                self._replay_module(tick, module, records)
        self._before = tick, records

    def _is_replaced(self, tick: _RecordedTick, topic: str, data: bytes) -> bool:
        """Whether the replay publishes this message's like; notes swaps and finished ticks on the way."""
        if topic == topics.EVENTS.name:
            event = self._decode(topic, data)
            if event is None or event.node not in self._nodes or event.subject.startswith("/"):  # of its node's topics
                return False
            if event.kind == EventKind.PARAMETERS:
                tick.swaps.setdefault(event.node, []).append(event)
            return True
        if _is_timing(topic):
            timing = self._decode(topic, data)
            node = timed_node(topic, timing)
            tick.timed[node] = timing.missing if timing else []
            return node in self._nodes
        return topic in self._outputs

    def _replay_module(self, tick: _RecordedTick, module: ReplayedModule, records: dict[str, Any]) -> None:
        is_timed = module.timing in self._timings
        recorded = self._recorded(tick, module.answer)
        # A node that was killed in this tick may have answered before it could say how long it took.
        has_finished = module.node in tick.timed or not is_timed
        is_given = module.is_given_input(tick.stamp, has_finished or recorded is not None, recorded)
        inputs = self._inputs(tick, module, records)  # even of a silent one: who is awaited next depends on it
        if inputs is None and recorded is not None:
            self._take_recorded(tick, module, records)
            return
        swaps = tick.swaps.get(module.node, ())
        if inputs is None:
            return
        if not is_given:
            module.unheard = tick.stamp, inputs, swaps
            return
        started = perf_counter()
        outputs = module.respond(tick.stamp, inputs, swaps)
        events = module.instance.take_events()
        for topic, record in outputs:
            if has_finished or topic in tick.messages:
                records[topic] = record
                self._sink(topic, record)
        if is_timed:
            spent = round((perf_counter() - started) * NANOSECONDS)
            self._sink(module.timing, Timing(tick.stamp, module.row.name, spent, missing(inputs)))
        for event in events:
            self._sink(topics.EVENTS.name, event)

    def _inputs(self, tick: _RecordedTick, module: ReplayedModule, records: dict[str, Any]) -> Sequence[Any] | None:
        """A module's inputs: as replayed where they are outputs of the replay, else as recorded."""
        instance, (earlier, replayed) = module.instance, self._before
        follows = earlier.stamp == tick.stamp - instance.module.parameters.tick_ns
        without = tick.timed.get(module.node)
        if without is not None:
            for place, topic in enumerate(instance.inputs):
                is_delayed = topic in instance.delayed
                there = replayed if is_delayed else records
                if place not in without and topic in self._outputs and topic not in there:
                    there |= self._outputs[topic].answer_unheard((earlier if is_delayed else tick).stamp)
        before = self._those(instance.delayed, earlier, replayed) if follows else {}
        now = self._those(instance.inputs.keys() - instance.delayed, tick, records)
        return instance.collect(now, before, without)

    def _those(self, names: Collection[str], tick: _RecordedTick, replayed: Mapping[str, Any]) -> dict[str, Any]:
        """The records of topics at a tick, of those that have one."""
        records = {
            topic: replayed.get(topic) if topic in self._outputs else self._recorded(tick, topic) for topic in names
        }
        return {topic: record for topic, record in records.items() if record is not None}

    def _take_recorded(self, tick: _RecordedTick, module: ReplayedModule, records: dict[str, Any]) -> None:
        """Copy an answer to what the bag lacks: a killed node may have reached others with it."""
        for topic in module.instance.outputs:
            for data in tick.messages.get(topic, ()):
                record = self._decode(topic, data)
                if record is not None:
                    records[topic] = record
                self._copy(topic, data, tick.stamp)
        module.orphans += 1

    def _recorded(self, tick: _RecordedTick, topic: str) -> Any:
        messages = tick.messages.get(topic)
        return self._decode(topic, messages[-1]) if messages else None


def _is_timing(topic: str) -> bool:
    return topic == topics.TIMING.of(topics.deputy_of(topic))
