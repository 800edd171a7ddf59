"""Scenario files are read as ROS itself reads parameter files."""

import json
import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import domain_coordinator
import pytest
import rclpy
import yaml
from hypothesis import given
from hypothesis import strategies as st
from rclpy.context import Context
from rclpy.node import Node

from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import read_yaml
from formation_gnc.sil.scenario import Scenario, duration_of, find_scenario, load_scenario

STATE = [10.0, -90.0, 10.0, 0.0, 0.0, 0.0]
CHIEF = {"semi_major_axis": 7.0e6, "inclination": 1.2}
PLANT = {"duration": 100.0, "deputy1": {"relative_state": STATE}}
NODES = ("/plant", "/deputy1/navigation", "/deputy1/guidance", "/deputy1/controller")

Write = Callable[[Any], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """A scenario file with these contents: text, or node names with their parameters."""

    def build(contents: Any) -> Path:
        path = tmp_path / "scenario.yaml"
        if not isinstance(contents, str):
            document = {node: {"ros__parameters": values} for node, values in contents.items()}
            contents = json.dumps(document)  # YAML without anchors, which ROS does not take
        path.write_text(contents)
        return path

    return build


@pytest.fixture(scope="module")
def by_ros() -> Iterator[Callable[[str, Path], dict[str, Any]]]:
    """What ROS gives a node of a full name for parameters when it is started with a file."""
    own = ("use_sim_time", "start_type_description_service")
    with domain_coordinator.domain_id() as domain:
        context = Context()
        rclpy.init(context=context, domain_id=domain)

        def ask(full_name: str, file: Path) -> dict[str, Any]:
            namespace, _, name = full_name.rpartition("/")
            node = Node(
                name,
                namespace=namespace,
                context=context,
                cli_args=["--ros-args", "--params-file", str(file)],
                use_global_arguments=False,
                enable_rosout=False,
                start_parameter_services=False,
                automatically_declare_parameters_from_overrides=True,
            )
            given = node.get_parameters_by_prefix("").values()
            node.destroy_node()
            return {each.name: each.value for each in given if each.name not in own}

        yield ask
        rclpy.shutdown(context=context)


@pytest.mark.parametrize("order", ["before", "after"])
@pytest.mark.parametrize(
    "pattern",
    [
        "/**",
        "/*",
        "/*/*",
        "/**/controller",
        "/*/controller",
        "/**/deputy1/*",
        "/**/**",
        "/deputy1/*",
        "/deputy1/**",
        "/deputy1/controller",
        "deputy1/controller",
        "plant",
        "*/guidance",
    ],
)
def test_a_pattern_means_the_nodes_that_it_means_to_ros(
    pattern: str, order: str, write: Write, by_ros: Callable[[str, Path], dict[str, Any]]
) -> None:
    exact: dict[str, Any] = {node: {"chief": CHIEF, "tick": 1.0} for node in NODES}
    exact["/plant"] |= PLANT
    contents = {pattern: {"tick": 2.0}} if order == "before" else {}
    contents |= {node: values for node, values in exact.items() if node != pattern}
    if pattern in exact:
        contents[pattern] = exact[pattern] | {"tick": 2.0}
    elif order == "after":
        contents[pattern] = {"tick": 2.0}
    path = write(contents)
    ours = load_scenario(str(path)).parameters()
    for node in NODES:
        assert ours[node]["tick"] == by_ros(node, path)["tick"]


@pytest.mark.parametrize(
    "text",
    [
        *("1", "-7", "+4", "0x10", "010", "1.0", "1.", ".5", "1e-6", "-1E+3", "1.5e3", ".inf"),
        *("true", "off", "'1'", "word", "[1, 2]", "[1.0, 2e-3]", "[a, b]", "[true, false]"),
        *("1_00.0", "2024-01-01", "08", "0b11", "0o17", "y", "N", "~", "null", "1e400", "0x1p3", "infinity"),
        *("12345678901234567890", "['1', b]", "<<", "=", "1.0f"),
    ],
)
def test_a_value_is_to_us_what_it_is_to_ros(
    text: str, write: Write, by_ros: Callable[[str, Path], dict[str, Any]]
) -> None:
    value = by_ros("/plant", write(f"/plant: {{ros__parameters: {{value: {text}}}}}"))["value"]
    value = value if isinstance(value, bool | int | float | str) else list(value)
    ours = read_yaml(text)
    assert (ours, type(ours)) == (value, type(value))


def test_a_written_scenario_gives_every_node_its_parameters_through_ros(
    tmp_path: Path, by_ros: Callable[[str, Path], dict[str, Any]]
) -> None:
    scenario = load_scenario("leader_follower", {"/**/guidance": {"preview_step": 1e-7}})
    path = tmp_path / "leader_follower.yaml"
    path.write_text(scenario.text({"/plant": {"wait_for_recorder": True}, "/recorder": {"bag": "here"}}))
    for node, values in scenario.parameters().items():
        extra = {"wait_for_recorder": True} if node == "/plant" else {}
        plain = {name: list(each) if isinstance(each, tuple) else each for name, each in values.items()} | extra
        given = {
            name: each if isinstance(each, bool | int | float | str) else list(each)
            for name, each in by_ros(node, path).items()
        }
        assert given == {name: each for name, each in plain.items() if each != []}
        assert {name: type(each) for name, each in given.items()} == {name: type(plain[name]) for name in given}
    assert by_ros("/recorder", path) == {"bag": "here"}


def test_a_scenario_written_and_read_again_is_the_same(tmp_path: Path) -> None:
    scenario = load_scenario("leader_follower", {"/**/controller": {"schedule": ["{at: 5.0, algorithm: coast}"]}})
    (tmp_path / "leader_follower.yaml").write_text(scenario.text())
    assert load_scenario(str(tmp_path / "leader_follower.yaml")) == scenario


def test_sections_of_recorder_and_display_are_handed_on(write: Write, tmp_path: Path) -> None:
    path = write(GOOD + "/display: {ros__parameters: {trail: 100.0}}\n")
    text = load_scenario(str(path)).text({"/recorder": {"bag": "here"}})
    (tmp_path / "again.yaml").write_text(text)
    again = load_scenario(str(tmp_path / "again.yaml"))
    assert again.others == {"/display": {"trail": 100.0}, "/recorder": {"bag": "here"}}


def test_namespaces_may_be_nested_and_parameters_too(write: Write) -> None:
    path = write("""
        /**: {ros__parameters: {chief: {semi_major_axis: 7.0e6}, chief.inclination: 0.5}}
        plant: {ros__parameters: {duration: 9., deputy1: {mass: 7, relative_state: [0., 9., 0., 0., 0., 0.]}}}
        deputy1:
          navigation: {ros__parameters: {radius_sigma: 2.0}}
          "*": {ros__parameters: {tick: 3.0}}
    """)
    scenario = load_scenario(str(path))
    assert scenario.name == "scenario"
    assert scenario.plant.deputy["deputy1"].mass == 7.0
    assert scenario.plant.chief.inclination == 0.5
    assert (scenario.plant.tick, scenario.deputies["deputy1"]["guidance"].tick) == (1.0, 3.0)
    assert scenario.deputies["deputy1"]["navigation"].radius_sigma == 2.0


def test_overrides_go_before_the_file() -> None:
    scenario = load_scenario("leader_follower", {"/plant": {"seed": 9}, "/**/controller": {"algorithm": "coast"}})
    assert (scenario.plant.seed, scenario.deputies["deputy1"]["controller"].algorithm) == (9, "coast")


def test_a_scenario_is_found_by_its_name_or_by_its_path() -> None:
    assert load_scenario("leader_follower") == load_scenario(str(find_scenario("leader_follower")))


def test_every_scenario_that_ships_can_be_loaded() -> None:
    shipped = sorted(find_scenario("leader_follower").parent.glob("*.yaml"))
    assert [load_scenario(path.stem).name for path in shipped] == [path.stem for path in shipped]


GOOD = f"""
/**: {{ros__parameters: {{chief: {{semi_major_axis: 7.0e6}}}}}}
/plant: {{ros__parameters: {{duration: 9.0, deputy1: {{relative_state: {STATE}}}}}}}
"""


def test_the_good_file_that_the_bad_ones_are_made_from_is_good(write: Write) -> None:
    assert load_scenario(str(write(GOOD))).plant.ticks == 9


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "duration: 9.0",
            "duration: .nan",
            "/plant: parameter duration: nan is not allowed; it must be finite",
        ),
        (
            "duration: 9.0",
            "duration: soon",
            "/plant: parameter duration: 'soon' is not allowed; it must be a",
        ),
        ("duration: 9.0", "duration: 2024-13-40", "'2024-13-40' is not allowed; it must be a value of type double"),
        ("duration: 9.0", "duration: 1:00.0", "'1:00.0' is not allowed; it must be a value of type double"),
        ("duration: 9.0", "duration: 1_0.0", "'1_0.0' is not allowed; it must be a value of type double"),
        ("[10.0, -90.0", "[10, -90.0", "line 3: the values of a list must be of one type, not float and int"),
        ("duration: 9.0", "duration: 9.0, duration: 8.0", "line 3: duration is given twice"),
        ("duration: 9.0", "chief: {inclination: 1.0}, chief.inclination: 2.0", "chief.inclination is given twice"),
        ("/plant:", "/**: {ros__parameters: {tick: 1.0}}\n/plant:", "line 3: /** is given twice"),
        ("/plant:", "/plnt: {ros__parameters: {}}\n/plant:", "/plnt (did you mean /plant?)"),
        ("/plant:", "controller: {ros__parameters: {}}\n/plant:", "controller (did you mean /**/controller?)"),
        ("/plant:", "/deputy2/controller: {ros__parameters: {a: 1}}\n/plant:", "(did you mean /deputy1/controller?)"),
        ("/plant:", "/*/controler: {ros__parameters: {a: 1}}\n/plant:", "sections of no node: /*/controler"),
        ("duration: 9.0,", "", "/plant: parameter duration: missing; give a double"),
        ("duration", "durration", "/plant: parameter durration: unknown; did you mean duration?"),
        ("7.0e6", "-7.0", "/plant: parameter chief.semi_major_axis: -7.0 is not allowed; it must be above 0"),
        (
            "7.0e6",
            "7.0e400",
            "/plant: parameter chief.semi_major_axis: '7.0e400' is not allowed; it must be a value of type double",
        ),
        ("deputy1:", "deputy2:", "/plant: parameter deputy2.relative_state: unknown; did you mean deputy1."),
        ("/plant:", "/x: {y: 3}\n/plant:", "/x/y is not a section; it must map to ros__parameters"),
        (
            "/plant:",
            "/pl*:",
            "/pl* is no node; a name has letters, digits, _ and / only, or * or ** between /",
        ),
        ("/plant:", "/a//plant:", "/a//plant is no node; a name has"),
        (
            "{ros__parameters: {dur",
            "{parameters: {dur",
            "/plant/parameters/duration is not a section; it must",
        ),
        ("/plant: {ros", "{ros", ": not YAML (while "),
    ],
)
def test_what_a_file_has_wrong_is_named(old: str, new: str, words: str, write: Write) -> None:
    assert old in GOOD
    with pytest.raises(ConfigurationError) as rejection:
        load_scenario(str(write(GOOD.replace(old, new))))
    assert words in str(rejection.value)
    assert "scenario.yaml: " in str(rejection.value)


@pytest.mark.parametrize("text", ["", "3", "- a\n- b\n", "word"])
def test_a_file_that_maps_no_nodes_is_no_parameter_file(text: str, write: Write) -> None:
    with pytest.raises(ConfigurationError, match="not a ROS 2 parameter file; it must map node names"):
        load_scenario(str(write(text)))


def test_a_file_that_cannot_be_read_says_why(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"/proc/self/mem: cannot be read \(Input/output error\)"):
        load_scenario("/proc/self/mem")  # opens for everybody, root included, and cannot be read
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(os.urandom(16) + b"\xff\xfe\x80")
    with pytest.raises(ConfigurationError, match=r"binary\.yaml: not YAML"):
        load_scenario(str(binary))


@pytest.mark.parametrize("name", ["nowhere", "", "leader follower"])
def test_an_unknown_name_is_answered_with_those_that_are_known(name: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        load_scenario(name)
    assert str(rejection.value).startswith(f"scenario {name}: unknown; it must be a parameter file or one of ")
    assert "leader_follower" in str(rejection.value)


@pytest.mark.parametrize("name", ["nowhere.yaml", "./nowhere", "/", "nowhere.yml"])
def test_a_path_that_leads_nowhere_is_named(name: str) -> None:
    with pytest.raises(ConfigurationError, match=f"scenario {name}: no such file"):
        load_scenario(name)


@pytest.fixture(scope="module")
def coarse() -> Scenario:
    """The default scenario with ticks of 10 s."""
    return load_scenario("leader_follower", {"/**": {"tick": 10.0}})


@given(orbits=st.floats(0.01, 100.0))
def test_a_number_of_orbits_is_flown_in_whole_ticks_and_to_the_end(orbits: float, coarse: Scenario) -> None:
    exact = orbits * 2.0 * math.pi / coarse.plant.mean_motion
    duration = duration_of(orbits, coarse)
    assert duration % 10.0 == 0.0
    assert exact - 1e-6 <= duration < exact + 10.0


@pytest.mark.parametrize("orbits", [0.0, -1.0, math.nan, math.inf])
def test_a_number_of_orbits_that_cannot_be_flown_is_rejected(orbits: float) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        duration_of(orbits, load_scenario("leader_follower"))
    assert str(rejection.value) == f"orbits: {orbits!r} is not allowed; it must be above 0 and finite"


def test_what_all_nodes_are_given_is_ignored_where_it_is_foreign_and_told(tmp_path: Path) -> None:
    """As the nodes do: a file for a robot's whole bring-up has sections of its other nodes under the pattern of all."""
    path = tmp_path / "shared.yaml"
    document = yaml.safe_load(find_scenario("leader_follower").read_text())
    document["/**"]["ros__parameters"] |= {"use_sim_time": True, "max_vel_x": 0.26}
    path.write_text(yaml.safe_dump(document, sort_keys=False))
    scenario = load_scenario(str(path))
    assert scenario.parameters() == load_scenario("leader_follower").parameters()
    assert scenario.ignored == ("max_vel_x",)


@pytest.mark.parametrize("pattern", ["/plant", "/**/controller", "/deputy1/*"])
def test_what_a_node_is_given_by_name_is_refused_where_it_is_foreign(tmp_path: Path, pattern: str) -> None:
    path = tmp_path / "addressed.yaml"
    own = yaml.safe_load(find_scenario("leader_follower").read_text())
    section = own.setdefault(pattern, {"ros__parameters": {}})
    section["ros__parameters"]["max_vel_x"] = 0.26
    path.write_text(yaml.safe_dump(own, sort_keys=False))
    with pytest.raises(ConfigurationError, match="max_vel_x: unknown"):
        load_scenario(str(path))


def test_an_override_of_all_nodes_is_meant_for_each() -> None:
    with pytest.raises(ConfigurationError, match="max_vel_x: unknown"):
        load_scenario("leader_follower", {"/**": {"max_vel_x": 0.26}})
