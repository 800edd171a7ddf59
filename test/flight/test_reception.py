"""What does not fit its type, or comes of a second publisher, is counted and named, and goes no further."""

from typing import Any

import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import reception as module
from formation_gnc.flight.reception import Reception, figures
from formation_gnc.flight.sources import SUCCESSION

NAMES = {b"own": "/plant", b"other": "/player", b"again": "/plant"}


class Clock:
    """A wall clock, s."""

    now = 0.0


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(module, "monotonic", lambda: clock.now)
    return clock


def decode(data: bytes) -> str:
    if data == b"short":
        raise ConfigurationError("5 bytes do not fit message type Measurement")
    return data.decode()


@pytest.fixture
def taken() -> list[str]:
    return []


@pytest.fixture
def reception(clock: Clock, taken: list[str]) -> Reception[str]:
    return Reception("/deputy1/measurement", decode, lambda record, _: taken.append(record), lambda: NAMES)


def about(publisher: bytes) -> dict[str, Any]:
    return {"publisher": publisher}


def test_what_does_not_fit_is_counted_by_publisher_and_said_once(reception: Reception[str], taken: list[str]) -> None:
    for data in (b"short", b"one", b"short", b"two"):
        reception.receive(data, about(b"own"))
    assert taken == ["one", "two"]
    assert reception.misfits == {"/plant": 2}
    (said,) = reception.look()
    assert "/plant" in said
    assert "do not fit message type Measurement" in said
    assert reception.look() == []
    assert figures([reception]) == {"ignored": 0, "misfits": 2}


def test_a_second_publisher_is_refused_and_named_once(reception: Reception[str], taken: list[str]) -> None:
    for publisher in (b"own", b"other", b"other", b"own"):
        reception.receive(publisher, about(publisher))
    assert taken == ["own", "own"]
    assert reception.look() == ["messages of /player are refused: /plant is heard"]
    assert reception.look() == []


def test_who_publishes_only_what_does_not_fit_is_not_kept_to(reception: Reception[str], taken: list[str]) -> None:
    for data, publisher in ((b"short", b"other"), (b"one", b"own"), (b"forged", b"other"), (b"two", b"own")):
        reception.receive(data, about(publisher))
    assert taken == ["one", "two"]


def test_what_was_held_counts_when_the_one_before_leaves_the_graph(
    reception: Reception[str], taken: list[str], clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    reception.receive(b"one", about(b"own"))
    clock.now = 1.0
    for data in (b"two", b"three"):
        reception.receive(data, about(b"again"))
    assert taken == ["one"]
    clock.now += SUCCESSION / 2  # sooner than its silence would say so
    monkeypatch.delitem(NAMES, b"own")
    reception.receive(b"four", about(b"again"))
    assert reception.look() == []
    assert taken == ["one", "two", "three", "four"]


def test_messages_of_a_node_started_again_are_held_not_lost(
    reception: Reception[str], taken: list[str], clock: Clock
) -> None:
    reception.receive(b"one", about(b"own"))
    clock.now = 1.0
    for data in (b"two", b"three"):
        reception.receive(data, about(b"again"))
    assert reception.look() == []
    assert taken == ["one"]
    clock.now += SUCCESSION
    reception.look()
    assert taken == ["one", "two", "three"]


def test_what_a_second_process_sent_is_dropped_when_the_first_goes_on(
    reception: Reception[str], taken: list[str], clock: Clock
) -> None:
    reception.receive(b"one", about(b"own"))
    reception.receive(b"forged", about(b"again"))
    reception.receive(b"two", about(b"own"))
    clock.now = 9.0
    reception.look()
    reception.receive(b"forged", about(b"again"))
    assert taken == ["one", "two"]
    assert reception.look() == ["messages of /plant are refused: /plant, another process, is heard"]
