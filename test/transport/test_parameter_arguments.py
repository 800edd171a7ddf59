"""Parameters on a command line: whose they are, which value holds, and what is left out as another node's."""

from pathlib import Path

import pytest

from formation_gnc.control.controller_manager import ControllerParameters
from formation_gnc.errors import ParameterError
from formation_gnc.parameters import load
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.transport.parameter_arguments import given_parameters, without_parameters

CONTROLLER = ("/alpha/deputy1/controller", "/deputy1/controller")


def file(directory: Path, name: str, text: str) -> list[str]:
    path = directory / name
    path.write_text(text)
    return ["--params-file", str(path)]


def test_sections_of_the_node_and_of_its_place_in_the_formation_hold(tmp_path: Path) -> None:
    text = (
        "/**: {ros__parameters: {tick: 1.0}}\n"
        "/deputy1/controller: {ros__parameters: {algorithm: coast, lqr: {thrust: 1e-3}}}\n"
        "/deputy2/controller: {ros__parameters: {algorithm: mpc}}\n"
        "/beta/deputy1/controller: {ros__parameters: {algorithm: hinf}}\n"
    )
    given = given_parameters(["node", "--ros-args", *file(tmp_path, "a.yaml", text)], CONTROLLER)
    assert given.values == {"tick": 1.0, "algorithm": "coast", "lqr.thrust": 1e-3}


def test_an_empty_list_is_a_value(tmp_path: Path) -> None:
    arguments = file(tmp_path, "a.yaml", "/**/controller: {ros__parameters: {schedule: []}}\n")
    assert given_parameters(["--ros-args", *arguments], CONTROLLER).values == {"schedule": []}


def test_an_option_goes_over_files_and_may_name_its_node(tmp_path: Path) -> None:
    arguments = ["n", "-p", "before:=1", "--ros-args", "-p", "algorithm:=coast", "-p", "controller:tick:=2.0"]
    arguments += ["--param", "/deputy1/controller:tick:=1e0", "-p", "/deputy2/controller:tick:=3.0"]
    arguments += [
        *file(tmp_path, "a.yaml", "/**/controller: {ros__parameters: {algorithm: mpc}}\n"),
        "--",
        "-p",
        "a:=1",
    ]
    given = given_parameters(arguments, CONTROLLER)
    assert given.values == {"algorithm": "coast", "tick": 1.0}
    assert without_parameters(arguments) == ["n", "-p", "before:=1", "--ros-args", "--", "-p", "a:=1"]


def test_what_is_given_to_all_and_is_another_ones_is_left_out(tmp_path: Path) -> None:
    shared = file(tmp_path, "a.yaml", "/**: {ros__parameters: {robot_description: x, tick: 1.0, deadline: 3.0}}\n")
    given = given_parameters(["--ros-args", *shared, "-p", "formation:=helix", "-p", "algorithm:=mpc"], CONTROLLER)
    dropped = given.drop_foreign(ControllerParameters)
    assert dropped == {"robot_description": "/**", "deadline": "/**", "formation": "-p"}
    assert given.values == {"tick": 1.0, "algorithm": "mpc"}


@pytest.mark.parametrize("pattern", ["/plant", "plant", "/*", "/**/plant"])
def test_what_is_addressed_to_the_node_is_not_left_out(tmp_path: Path, pattern: str) -> None:
    arguments = file(tmp_path, "a.yaml", f"{pattern}: {{ros__parameters: {{robot_description: x}}}}\n")
    given = given_parameters(["--ros-args", *arguments], ("/plant",))
    assert given.drop_foreign(PlantParameters) == {}
    with pytest.raises(ParameterError, match="parameter robot_description: unknown"):
        load(PlantParameters, given.values)


def test_a_misspelt_option_is_not_left_out() -> None:
    given = given_parameters(["--ros-args", "-p", "deadlin:=1.0"], ("/plant",))
    assert given.drop_foreign(PlantParameters) == {}
    with pytest.raises(ParameterError, match="did you mean deadline"):
        load(PlantParameters, given.values)
