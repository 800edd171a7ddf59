"""Several publishers of one topic: the first is heard until it is gone, and the others are named."""

from formation_gnc.flight.sources import LOOK, SUCCESSION, UNKNOWN, SourceLock, Verdict, is_shared, names_of, shared

FIRST, SECOND, THIRD = b"first", b"second", b"third"


class Graph:
    """Publishers of a topic, and how often they were asked for."""

    def __init__(self, **names: str) -> None:
        self.names = {identity.encode(): name for identity, name in names.items()}
        self.asked = 0

    def __call__(self) -> dict[bytes, str]:
        self.asked += 1
        return self.names


def heard(graph: Graph) -> SourceLock:
    """A lock that keeps to the first publisher."""
    lock = SourceLock(graph)
    assert lock.judge(FIRST, 0.0) is Verdict.COUNTS
    lock.choose(FIRST)
    return lock


def test_a_second_publisher_is_refused_whatever_it_sends_and_however_often() -> None:
    lock = heard(Graph(first="/plant", second="/player"))
    for now in range(100):
        assert lock.judge(SECOND, float(now)) is Verdict.REFUSED
        assert lock.judge(FIRST, now + 0.5) is Verdict.COUNTS
        assert not lock.succeeds(now + 0.5)
    assert lock.refused == {"/player": 100}


def test_one_whose_message_was_of_no_use_is_not_kept_to() -> None:
    lock = SourceLock(Graph(first="/plant", second="/player"))
    assert lock.judge(SECOND, 0.0) is Verdict.COUNTS  # and does not fit: it is not chosen
    assert lock.judge(FIRST, 0.0) is Verdict.COUNTS
    lock.choose(FIRST)
    assert lock.judge(SECOND, 1.0) is Verdict.REFUSED


def test_another_node_succeeds_at_once_when_the_first_has_left_the_graph() -> None:
    graph = Graph(first="/plant", second="/replay")
    lock = heard(graph)
    assert lock.judge(SECOND, 1.0) is Verdict.REFUSED
    del graph.names[FIRST]
    assert lock.judge(SECOND, 1.0 + LOOK) is Verdict.COUNTS
    assert lock.chosen == SECOND


def test_a_node_started_again_succeeds_its_killed_process_after_a_silence() -> None:
    lock = heard(Graph(first="/deputy1/navigation", second="/deputy1/navigation"))
    assert lock.judge(SECOND, 1.0) is Verdict.HELD
    assert not lock.succeeds(1.0 + 0.9 * SUCCESSION)
    assert lock.succeeds(1.0 + SUCCESSION)
    assert lock.judge(SECOND, 2.0) is Verdict.COUNTS


def test_a_second_process_of_the_name_never_counts_while_the_first_goes_on() -> None:
    lock = heard(Graph(first="/deputy1/controller", second="/deputy1/controller"))
    for now in (1.0, 2.0, 3.0):
        assert lock.judge(SECOND, now) is not Verdict.COUNTS
        assert lock.judge(FIRST, now + 0.1) is Verdict.COUNTS
        assert not lock.succeeds(now + 0.9)
    assert lock.refused == {"/deputy1/controller": 2}


def test_a_process_that_was_slow_counts_again_and_its_successor_does_not() -> None:
    lock = heard(Graph(first="/deputy1/controller", second="/deputy1/controller"))
    assert lock.judge(SECOND, 1.0) is Verdict.HELD
    assert lock.succeeds(2.0)
    assert lock.judge(FIRST, 3.0) is Verdict.COUNTS
    assert lock.judge(SECOND, 3.1) is Verdict.REFUSED
    assert not lock.succeeds(9.0)


def test_a_stranger_without_a_name_yet_is_held_and_does_not_take_over() -> None:
    graph = Graph(first="/plant", second=f"/{UNKNOWN}")
    lock = heard(graph)
    assert lock.judge(SECOND, 1.0) is Verdict.HELD
    graph.names[SECOND] = "/stranger"
    assert not lock.succeeds(2.0)
    assert lock.judge(SECOND, 3.0) is Verdict.REFUSED
    assert lock.judge(FIRST, 3.0) is Verdict.COUNTS


def test_a_flood_of_a_stranger_asks_the_graph_ten_times_a_second() -> None:
    graph = Graph(first="/plant", second="/player")
    lock = heard(graph)
    for number in range(10_000):
        lock.judge(SECOND, 1.0 + number * 1e-4)
    assert graph.asked <= 1.0 / LOOK + 1


def test_the_one_that_counts_never_asks_the_graph() -> None:
    graph = Graph(first="/plant")
    lock = heard(graph)
    for now in range(3):
        assert lock.judge(FIRST, float(now)) is Verdict.COUNTS
    assert graph.asked == 0


def test_a_node_started_again_is_no_stranger_and_two_of_a_name_are_counted() -> None:
    assert not is_shared(["/plant", "/plant"])
    assert is_shared(["/plant", "/rosbag2_player"])
    assert names_of(["/b", "/a", "/b"]) == "/a and /b (2 times)"
    offers = {"/clock": ["/plant", "/plant"], "/truth": ["/plant"]}
    assert list(shared(("/clock", "/truth"), offers.__getitem__)) == [("/clock", "/plant (2 times)")]
