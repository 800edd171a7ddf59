"""What counts of a topic: messages of one publisher that fit their type."""

from collections import Counter, deque
from collections.abc import Callable, Mapping
from time import monotonic
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.sources import SourceLock, Verdict

Information = dict[str, Any]
"""What is known of a message: `publisher` (identity, bytes), `source_timestamp` (ns, system clock) and
`publication_sequence_number` (None for none)."""

HELD = 20_000
"""Messages kept of who may succeed the publisher before, the latest: those of a second of the fastest flight are fewer,
and none of a node that was started again is lost to the recorder."""


class Reception[T]:
    """Stands between the middleware and what works with a topic's records.

    A message that does not fit its type, or holds values that its record does not allow, is counted by its publisher
    and goes no further; neither does one of a second publisher (:class:`SourceLock`).
    """

    def __init__(
        self,
        topic: str,
        decode: Callable[[bytes], T],
        take: Callable[[T, Information], object],
        publishers: Callable[[], Mapping[bytes, str]],
    ) -> None:
        """Receive nothing yet.

        Args:
            topic: its name within the formation.
            decode: the record of a message; raises ConfigurationError for one that does not fit.
            take: takes the records that count; returns False, and only that, for one that is of no use, whose publisher
                is not kept to yet.
            publishers: full names of the nodes that publish the topic, by identity.
        """
        self.topic = topic
        self.lock = SourceLock(publishers)
        self.misfits: Counter[str] = Counter()
        """Messages that do not fit, by the name of the node."""
        self._decode, self._take = decode, take
        self._held = deque[tuple[bytes, Information]](maxlen=HELD)
        self._said: set[str] = set()
        self._new: list[str] = []

    def receive(self, data: bytes, about: Information) -> None:
        """Take a message from the middleware."""
        publisher = about["publisher"]
        if publisher == self.lock.chosen and self.lock.candidate is None:  # the common case
            self._count(data, about)
            return
        now = monotonic()
        verdict = self.lock.judge(publisher, now)
        if verdict is Verdict.COUNTS:
            self._release()  # the one before may have left just now
            self._count(data, about)
        elif verdict is Verdict.HELD:
            self._held.append((data, about))
        else:
            name, heard = (self.lock.name_of(each, now) for each in (publisher, self.lock.chosen or b""))
            twin = ", another process," if name == heard else ""
            self._note(f"messages of {name} are refused: {heard}{twin} is heard")

    def look(self) -> list[str]:
        """Let the publisher of what is held succeed, if it may; returns what is new to say, in words."""
        if self._held and self.lock.succeeds(monotonic()):
            self._release()
        new, self._new = self._new, []
        return new

    def _release(self) -> None:
        """Let what was held of the publisher that counts now count, and drop that of others."""
        held = list(self._held)
        self._held.clear()
        for data, about in held:
            if about["publisher"] == self.lock.chosen:
                self._count(data, about)

    def _count(self, data: bytes, about: Information) -> None:
        publisher = about["publisher"]
        try:
            record = self._decode(data)
        except ConfigurationError as misfit:
            name = self.lock.name_of(publisher, monotonic())
            self.misfits[name] += 1
            self._note(f"a message of {name} is not taken: {misfit}", f"misfit {name}")
            return
        if self._take(record, about) is not False and publisher != self.lock.chosen:
            self.lock.choose(publisher)

    def _note(self, text: str, key: str = "") -> None:
        """Say something once."""
        if (key or text) not in self._said:
            self._said.add(key or text)
            self._new.append(text)


def figures(receptions: list[Reception[Any]]) -> dict[str, int]:
    """Messages that did not count, for diagnostics."""
    return {
        "ignored": sum(each.lock.ignored for each in receptions),
        "misfits": sum(each.misfits.total() for each in receptions),
    }
