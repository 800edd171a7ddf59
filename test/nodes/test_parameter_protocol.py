"""What `ros2 param` sends, on every node: dumps come back, every value set in flight is understood or refused."""

import inspect
import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, get_args

import pytest
import yaml
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters, SetParametersAtomically
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter, get_parameter_value, parameter_dict_from_yaml_file, parameter_value_to_python

import formation_gnc
from formation_gnc.errors import ParameterError
from formation_gnc.flight.graph import MODULES
from formation_gnc.parameters import Leaf, dump, leaves
from formation_gnc.transport.module_node import ModuleNode
from formation_gnc.transport.node import ConfiguredNode

from .conftest import MAKERS, Bench

pytestmark = pytest.mark.sil

EVERY_NODE = pytest.mark.parametrize("name", MAKERS)


def dumped(bench: Bench, node: ConfiguredNode) -> dict[str, Any]:
    """What `ros2 param dump` prints, as it asks for it."""
    names = bench.call(node, ListParameters, "list_parameters", ListParameters.Request()).result.names
    values = bench.call(node, GetParameters, "get_parameters", GetParameters.Request(names=names)).values
    tree: dict[str, Any] = {}
    for name, value in sorted(zip(names, values, strict=True), key=lambda pair: str(pair[0])):
        *path, last = name.split(".")
        branch = tree
        for token in path:
            branch = branch.setdefault(token, {})
        branch[last] = parameter_value_to_python(value)
    return {node.get_fully_qualified_name(): {"ros__parameters": tree}}


def write(path: Path, document: dict[str, Any]) -> Path:
    path.write_text(yaml.dump(document, default_flow_style=False))
    return path


def set_each(bench: Bench, node: ConfiguredNode, *parameters: ParameterMessage) -> list[Any]:
    """As `ros2 param set` and `load`."""
    request = SetParameters.Request(parameters=list(parameters))
    return list(bench.call(node, SetParameters, "set_parameters", request).results)


@EVERY_NODE
def test_no_node_has_an_attribute_of_rclpys_own(bench: Bench, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    written = set[str]()

    def note(node: Node, attribute: str, value: Any) -> None:
        if f"/{formation_gnc.__name__}/" in sys._getframe(1).f_code.co_filename:
            written.add(attribute)
        object.__setattr__(node, attribute, value)

    monkeypatch.setattr(ConfiguredNode, "__setattr__", note)
    node = bench.make(name)
    rclpys = vars(bench.user).keys() | {each for each, _ in inspect.getmembers(Node)}
    assert written
    assert not written & rclpys
    defined = {each for kind in type(node).__mro__ if issubclass(kind, ConfiguredNode) for each in vars(kind)}
    extended = {"destroy_node", "set_parameters_atomically"}  # these call rclpy's
    assert {each for each in defined & rclpys if not each.startswith("__")} <= extended


@EVERY_NODE
@pytest.mark.parametrize("way", ["option", "file", "service"])
def test_wall_time_does_not_stand_still_with_simulated_time(bench: Bench, name: str, way: str) -> None:
    file = write(bench.directory / "shared.yaml", {"/**": {"ros__parameters": {"use_sim_time": True}}})
    ways = {
        "option": {"arguments": ("-p", "use_sim_time:=true")},
        "file": {"files": (bench.scenario, file)},
        "service": {},
    }
    given: dict[str, Any] = ways[way]
    node = bench.make(name, *given.get("arguments", ()), files=given.get("files"))
    if way == "service":
        (result,) = set_each(bench, node, Parameter("use_sim_time", value=True).to_parameter_msg())
        assert result.successful
    assert node.get_parameter("use_sim_time").value is True
    ticks: list[int] = []
    node.create_wall_timer(0.01, lambda: ticks.append(1))
    bench.spin(node, until=lambda: len(ticks) >= 3)
    assert all(timer.clock.clock_type == ClockType.STEADY_TIME for timer in node.timers)


@EVERY_NODE
def test_a_dump_comes_back_by_file_and_by_load(bench: Bench, name: str) -> None:
    node = bench.make(name)
    document = dumped(bench, node)
    file = write(bench.directory / "dump.yaml", document)
    sent = list(parameter_dict_from_yaml_file(str(file)).values())
    results = set_each(bench, node, *sent)
    assert [(p.name, r.reason) for p, r in zip(sent, results, strict=True) if not r.successful] == []
    assert dumped(bench, node) == document
    if isinstance(node, ModuleNode):
        node._module.begin_tick(0)
        assert node._module.take_events() == [], "a value that it has is no change"
    if name != "recorder":  # whose bag is there now
        assert bench.make(name, files=(file,)).values == node.values


def changed(leaf: Leaf, value: Any) -> Iterator[Any]:
    """Other values of a parameter that its limits allow."""
    if isinstance(value, tuple):
        if leaf.limits.length is None:
            yield ()
        scalar = replace(leaf, type=get_args(leaf.type)[0])
        yield from zip(*(changed(scalar, each) for each in value), strict=False)
    elif isinstance(value, bool):
        yield not value
    elif isinstance(value, str):
        yield from (each for each in leaf.limits.choices if each != value)
    else:
        kind = leaf.type
        for other in (1.0000001 * value, kind(round(2.0 * value + 1.0)), 0.5 * value, 1e-6, 1):
            if isinstance(other, kind) and other != value:
                with suppress(ParameterError):
                    yield leaf.check(other)


def ways(value: Any) -> Iterator[ParameterValue]:
    """How a value is sent: by `ros2 param set` as it may be typed, by `load`, and by programs."""
    plain = list(value) if isinstance(value, tuple) else value
    yield get_parameter_value(yaml.safe_dump(plain, default_flow_style=True) if isinstance(plain, list) else str(plain))
    if isinstance(value, float):
        yield get_parameter_value(f"{value:.17e}")
        yield ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        if value.is_integer():
            yield ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=int(value))
    elif isinstance(value, tuple) and value and isinstance(value[0], float):
        yield get_parameter_value(str([int(each) if each.is_integer() else each for each in value]))
        yield get_parameter_value(str([f"{each:.17e}" for each in value]))
        yield ParameterValue(type=ParameterType.PARAMETER_DOUBLE_ARRAY, double_array_value=plain)
    elif value == ():
        for kind in (each for each in Parameter.Type if each.name.endswith("ARRAY")):
            yield ParameterValue(type=kind.value)


@pytest.mark.parametrize("name", MODULES)
def test_whatever_is_set_in_flight_in_whatever_way_replays(bench: Bench, name: str) -> None:
    node = bench.make(name)
    row, module = MODULES[name], node._module
    in_flight = [leaf for leaf in leaves(row.parameters, dump(module.parameters)) if leaf.limits.in_flight]
    assert in_flight
    values = {leaf.name: list(islice(changed(leaf, dump(module.parameters)[leaf.name]), 2)) for leaf in in_flight}
    if "algorithm" in values:
        values["algorithm"] = ["coast"]  # which costs no design, and has every law's parameters nevertheless
    later = next((name, *of[:1]) for name, of in values.items() if of and name != "schedule")
    values["schedule"] = [(json.dumps({"at": 9e5, later[0]: later[1]}),), ("{at: 9.0e+5, schedule: 'a'}",), ()]
    kinds = {(leaf.type, leaf.limits.length, bool(leaf.limits.choices)): leaf for leaf in reversed(in_flight)}
    for leaf in (*kinds.values(), next(leaf for leaf in in_flight if leaf.name == "schedule")):
        for value in values[leaf.name][:2]:
            for way in ways(value):
                before = module.parameters
                (result,) = set_each(bench, node, ParameterMessage(name=leaf.name, value=way))
                module.begin_tick(module.time)
                events = module.take_events()
                if not result.successful:  # of a wrong value for other reasons than its type
                    assert module.parameters is before
                    assert "value of type" not in result.reason
                    assert not events
                    continue
                held = dump(module.parameters)[leaf.name]
                assert held == value
                assert node.get_parameter(leaf.name).value == (list(held) if isinstance(held, tuple) else held)
                again = row.module(module.name, before)
                for event in events:
                    again.commit(again.stage({each.name: json.loads(each.new_value) for each in event.changes}))
                again.begin_tick(module.time)
                assert again.parameters == module.parameters


@EVERY_NODE
def test_a_request_of_no_sense_is_refused_with_a_reason(bench: Bench, name: str) -> None:
    node = bench.make(name)
    before = dumped(bench, node)
    byte = ParameterValue(type=ParameterType.PARAMETER_BYTE_ARRAY, byte_array_value=[b"1"])
    requests = [
        ParameterMessage(name="tick", value=ParameterValue(type=99)),
        ParameterMessage(name="tick"),  # `ros2 param delete`
        ParameterMessage(name="tick", value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=2.0)),
        ParameterMessage(name="tick", value=byte),
        ParameterMessage(name="there.is.none", value=get_parameter_value("1")),
        ParameterMessage(name="", value=get_parameter_value("1")),
    ]
    for request in requests:
        (result,) = set_each(bench, node, request)
        assert not result.successful
        assert result.reason
        atomically = SetParametersAtomically.Request(parameters=[request])
        assert not bench.call(node, SetParametersAtomically, "set_parameters_atomically", atomically).result.successful
    assert dumped(bench, node) == before


@EVERY_NODE
def test_a_parameter_is_described_with_meaning_and_limits(bench: Bench, name: str) -> None:
    node = bench.make(name)
    names = [each.name for each in leaves(type(node.values), dump(node.values))]
    answer = bench.call(node, DescribeParameters, "describe_parameters", DescribeParameters.Request(names=names))
    for each in answer.descriptors:
        assert each.description
        assert each.type == Parameter.Type[node._leaves[each.name].type_name.replace(" ", "_").upper()].value


@pytest.mark.parametrize("name", MODULES)
def test_what_a_schedule_sets_is_what_the_services_give(bench: Bench, name: str) -> None:
    node = bench.make(name)
    leaf, value = next(
        (leaf, value)
        for leaf in leaves(type(node.values), dump(node.values))
        if leaf.limits.in_flight and leaf.name != "schedule"
        for value in changed(leaf, dump(node.values)[leaf.name])
    )
    entry = json.dumps({"at": 1.0, leaf.name: value})
    set_each(bench, node, ParameterMessage(name="schedule", value=get_parameter_value(str([entry]))))
    for time in (0, 1_000_000_000):
        node._module.begin_tick(time)
    node._publish_events()
    assert node.get_parameter(leaf.name).value == value
