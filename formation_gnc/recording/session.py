"""Recording of a run: messages, losses, progress and parameters."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES
from formation_gnc.flight.reception import Information, Reception
from formation_gnc.parameters import to_json
from formation_gnc.recording.layout import LAYOUT, foxglove_layout
from formation_gnc.recording.loss import LossCounter
from formation_gnc.recording.parameter_collection import PLANT, ParameterCollection
from formation_gnc.recording.progress import NONE, RecordingProgress
from formation_gnc.recording.provenance import IGNORED, LOST, parameters_record
from formation_gnc.recording.snapshot import Snapshot
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import Event

REPORT_TICKS = 64
"""Most ticks between two reports of progress."""


class RecordingSession:
    """Writes the messages of all topics to a bag.

    Attributes:
        failure: error of the disk, after which nothing is recorded; None for none.
    """

    def __init__(
        self,
        bag: BagWriter,
        scenario: str,
        report: Callable[[int], None],
        decode_event: Callable[[bytes], Event],
        snapshot: float = 0.0,
    ) -> None:
        """Record to a bag.

        Args:
            bag: closed by `close`.
            scenario: its name, for the bag's metadata.
            report: receives the stamp (ns) up to which everything is recorded, whenever it has changed.
            decode_event: decodes a message on `/events`.
            snapshot: s of simulated time to keep in memory until `write_snapshot`; 0 to write everything at once.
        """
        self.bag, self._scenario, self._decode_event = bag, scenario, decode_event
        self.failure: OSError | None = None
        self.parameters = ParameterCollection()
        self.progress = RecordingProgress()
        self._report, self._reported = report, NONE - 1
        self._snapshot = Snapshot(bag, snapshot) if snapshot else None
        self._write = self._snapshot.write if self._snapshot else bag.write
        self._losses: dict[str, LossCounter] = {}
        self._receptions: dict[str, Reception[bytes]] = {}
        self._misfits: Counter[str] = Counter()
        self._said = [0, 0]
        self._received = True

    def open_topic(
        self, topic: str, type_name: str, publishers: Callable[[], Mapping[bytes, str]], latched: bool
    ) -> Callable[[bytes, Information], None]:
        """Add a topic to the bag.

        Args:
            topic: full name.
            type_name: of its messages.
            publishers: full names of the nodes that publish it just now, by the identities of their publishers.
            latched: whether late subscribers get what was published before.

        Returns:
            What takes its messages: CDR bytes and what is known of them, their `stamp` in ns included. Of a topic with
            a message at every tick, those of a second publisher are left out (:class:`Reception`).
        """
        self.bag.add_topic(topic, type_name, topics.QUEUE_DEPTH)
        loss, node = LossCounter(latched), _answering(topic)
        self._losses[topic] = loss
        is_ours = type_name in topics.types_of(topic)
        is_clock, is_events = is_ours and topic == topics.CLOCK.name, is_ours and topic == topics.EVENTS.name
        concerns_progress = is_ours and self.progress.concerns(topic)
        count = 0

        def take(data: bytes, about: Information) -> None:
            nonlocal count
            stamp, number = about["stamp"], about["publication_sequence_number"]
            count += 1
            if number is not None:
                loss.take(about["publisher"], number)
            if node and number == 1 and count > 1:
                self.parameters.restarted(node, stamp)
            if is_events:
                try:
                    self.progress.take_event(self._decode_event(data))
                except ConfigurationError:  # no event at all
                    self._misfits[topic] += 1
                    return
            self._write(topic, data, stamp, number or count)
            if concerns_progress:
                self.progress.take(topic, stamp, lambda: len(publishers()))
            if is_clock and count % REPORT_TICKS == 0:
                self.report_progress()

        if is_ours and topic in topics.of_one_publisher(topics.deputy_of(topic)):
            reception = self._receptions[topic] = Reception(topic, lambda data: data, take, publishers)
            return self.while_disk_lasts(self._noting(reception.receive))
        return self.while_disk_lasts(self._noting(take))

    def _noting(self, take: Callable[[bytes, Information], None]) -> Callable[[bytes, Information], None]:
        """Wrap what takes messages to note that there are any."""

        def noting(data: bytes, about: Information) -> None:
            self._received = True
            take(data, about)

        return noting

    def look(self) -> Iterator[tuple[str, str]]:
        """Let publishers succeed those before them; yields topics and what is new to say of each, in words."""
        for topic, reception in self._receptions.items():
            for text in reception.look():
                yield topic, text

    def report_progress(self) -> None:
        """Report the progress, if it has changed."""
        stamp = self.progress.stamp
        if stamp != self._reported:
            self._reported = stamp
            self._report(stamp)

    def put_on_record(self, node: str, record: str, values: Mapping[str, Any], left_out: tuple[str, ...] = ()) -> None:
        """Write the parameters of a node at once, so that a bag that is cut short can be replayed."""
        if not self.parameters.received(node, record, values):
            return
        recorded = {name: to_json(value) for name, value in values.items() if name not in left_out}
        self.bag.add_metadata(record, recorded)
        if record == parameters_record(PLANT):
            self.bag.add_metadata("run", {"scenario": self._scenario, "seed": str(values.get("seed", ""))})
            self.bag.add_attachment(LAYOUT, foxglove_layout(values.get("deputies", ())).encode())

    def write_snapshot(self) -> tuple[bool, str]:
        """Write the messages kept in memory; returns whether that succeeded, and a message for people."""
        written: list[str] = []

        def write() -> None:
            assert self._snapshot is not None, "only a recording with a snapshot is triggered"
            written.append(f"{self._snapshot.trigger()} messages written to {self.bag.directory}")

        self.while_disk_lasts(write)()
        return bool(written), written[0] if written else str(self.failure)

    def new_troubles(self) -> list[str]:
        """What has been lost, or left out as other publishers', since the last call, in words."""
        found = {f"lost so far: {_counts(self.lost_by_topic)}": self.lost}
        found[f"left out so far, of other publishers: {_counts(self.ignored)}"] = sum(self.ignored.values())
        said, self._said = self._said, list(found.values())
        return [text for (text, total), before in zip(found.items(), said, strict=True) if total > before]

    @property
    def lost_by_topic(self) -> dict[str, int]:
        """Messages lost so far by topic, where there are any."""
        return {topic: each.lost for topic, each in self._losses.items() if each.lost}

    @property
    def ignored(self) -> dict[str, int]:
        """Messages left out so far by topic: of other publishers, and on `/events` those that are no events."""
        locked = {topic: each.lock.ignored for topic, each in self._receptions.items() if each.lock.ignored}
        return locked | self._misfits

    @property
    def lost(self) -> int:
        """Messages lost so far."""
        return sum(each.lost for each in self._losses.values())

    def is_quiet(self) -> bool:
        """Whether nothing was received since the last call; False at the first."""
        quiet, self._received = not self._received, False
        return quiet

    def while_disk_lasts[**P](self, work: Callable[P, None]) -> Callable[P, None]:
        """Wrap `work` to stop at an error of the disk, which an executor would swallow."""

        def guarded(*arguments: P.args, **keywords: P.kwargs) -> None:
            if self.failure is None:
                try:
                    work(*arguments, **keywords)
                except OSError as failure:
                    self.failure = failure

        return guarded

    def close(self) -> None:
        """Finish the bag."""
        if self.failure is None:
            self.bag.add_metadata(LOST, {topic: str(each.lost) for topic, each in self._losses.items()})
            if self.ignored:
                self.bag.add_metadata(IGNORED, {topic: str(count) for topic, count in self.ignored.items()})
            self.bag.close()


def _counts(by_topic: Mapping[str, int]) -> str:
    return ", ".join(f"{count} of {topic}" for topic, count in by_topic.items())


def _answering(topic: str) -> str:
    """Full name of the module that answers a tick on a topic; empty for none."""
    deputy, name = topics.deputy_of(topic), topic.rpartition("/")[2]
    return next((f"/{deputy}/{row.name}" for row in MODULES.values() if deputy and row.answer.name == name), "")
