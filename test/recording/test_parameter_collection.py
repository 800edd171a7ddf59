"""Whose parameters are asked for, and when."""

from formation_gnc.flight.graph import GRAPH
from formation_gnc.recording.parameter_collection import ASK_AGAIN, ParameterCollection

NODES = ["/plant", *(f"/deputy1/{row.name}" for row in GRAPH)]


def complete() -> ParameterCollection:
    """All nodes of a run with one deputy have answered."""
    collection = ParameterCollection()
    collection.appeared(NODES)
    for node, record in collection.due(0.0).items():
        assert collection.received(node, record, {"deputies": ["deputy1"]})
    return collection


def test_every_node_is_asked_once_when_it_appears() -> None:
    collection = ParameterCollection()
    assert collection.appeared(["/plant"]) == ["/plant"]
    assert collection.appeared(["/plant"]) == []
    assert collection.due(0.0) == {"/plant": "parameters /plant"}
    collection.asked("/plant", 0.0)
    assert collection.due(0.5 * ASK_AGAIN) == {}


def test_a_node_that_does_not_answer_is_asked_again() -> None:
    collection = ParameterCollection()
    collection.appeared(["/plant"])
    collection.asked("/plant", 0.0)
    assert list(collection.due(ASK_AGAIN)) == ["/plant"]
    collection.asked("/plant", ASK_AGAIN)
    assert collection.received("/plant", "parameters /plant", {"seed": 1})
    assert not collection.received("/plant", "parameters /plant", {"seed": 1}), "asked twice, answered twice"
    assert collection.due(10.0 * ASK_AGAIN) == {}


def test_the_run_is_known_when_every_module_of_every_deputy_is() -> None:
    collection = ParameterCollection()
    assert not collection.is_complete(0.0)
    collection.appeared(NODES)
    for node, record in collection.due(0.0).items():
        assert not collection.is_complete(0.0)
        collection.received(node, record, {"deputies": ["deputy1"]})
    assert collection.is_complete(0.0)


def test_a_node_started_again_is_asked_again_for_its_first_answer() -> None:
    collection = complete()
    collection.restarted("/deputy1/guidance", 7)
    assert collection.due(0.0) == {"/deputy1/guidance": "parameters /deputy1/guidance from 7"}
    late = ("/deputy1/guidance", "parameters /deputy1/guidance", {"slot": 1})
    assert not collection.received(*late), "the answer of the process before"
    collection.restarted("/deputy9/stranger", 7)
    assert "/deputy9/stranger" not in collection.due(0.0)


def test_a_node_without_parameter_services_is_not_waited_for_long() -> None:
    collection = ParameterCollection(values={"/plant": {"deputies": ["deputy1"]}})
    assert collection.find(["/plant"], "/", lambda topic: ["/somebody"], 1.0) == {"/plant": "/plant"}
    assert not collection.is_complete(1.0)
    assert collection.is_complete(1.0 + 2.0 * ASK_AGAIN)


def test_a_node_of_another_name_counts_by_what_it_publishes() -> None:
    collection = complete()
    publishers = {"/truth": ["/alpha/world"], "/deputy1/thrust": ["/alpha/deputy1/law"]}
    known = ["/alpha/world", "/alpha/deputy1/law", "/alpha/deputy1/guidance", "/beta/plant"]
    found = collection.find(known, "/alpha/", lambda topic: publishers.get(topic, []), 0.0)
    assert found["/plant"] == "/alpha/world"
    assert found["/deputy1/controller"] == "/alpha/deputy1/law"
    assert found["/deputy1/guidance"] == "/alpha/deputy1/guidance"
    assert "/alpha/plant" not in found
    assert "/beta/plant" not in found.values(), "of another formation"
