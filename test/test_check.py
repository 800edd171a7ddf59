"""`formation-gnc check`: values with their source, warnings and notes; and scenarios that extend others."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.cli import main
from formation_gnc.errors import ConfigurationError
from formation_gnc.sil.preflight import notes
from formation_gnc.sil.scenario import load_scenario

Write = Callable[..., str]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """A scenario file of a name with this text; its path."""

    def build(text: str, name: str = "mine") -> str:
        path = tmp_path / f"{name}.yaml"
        path.write_text(text)
        return str(path)

    return build


MINE = """
extends: leader_follower
/**:
  ros__parameters: {tick: 10 s}
/deputy1/controller:
  ros__parameters: {lqr.thrust: [1 mN, 1 mN, 1 mN]}
"""


def test_a_scenario_that_extends_another_holds_what_differs(write):
    base, mine = load_scenario("leader_follower").parameters(), load_scenario(write(MINE)).parameters()
    changed = {
        (node, name): value
        for node, values in mine.items()
        for name, value in values.items()
        if value != base[node][name]
    }
    nodes = ("/plant", "/deputy1/navigation", "/deputy1/guidance", "/deputy1/controller", "/deputy1/supervisor")
    assert {key: value for key, value in changed.items() if key[1] == "tick"} == {
        (node, "tick"): 10.0 for node in nodes
    }
    assert changed["/deputy1/controller", "lqr.thrust"] == (0.001, 0.001, 0.001)
    assert load_scenario(write("extends: leader_follower")).parameters() == base


def test_a_file_extends_one_beside_it_and_so_on(write):
    write(MINE)
    path = write("extends: mine.yaml\n/plant:\n  ros__parameters: {duration: 1 h}\n", "further")
    plant = load_scenario(path).parameters()["/plant"]
    assert (plant["tick"], plant["duration"]) == (10.0, 3600.0)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("extends: nowhere", "extends: scenario nowhere: unknown; it must be a parameter file or one of"),
        ("extends: no/such.yaml", "extends: scenario no/such.yaml: no such file"),
        ("extends: mine.yaml", "extends mine.yaml: goes in a circle"),
        ("extends: [leader_follower]", r"extends: \['leader_follower'\] is not allowed; it must name a scenario"),
        ("extends: 3", "extends: 3 is not allowed"),
    ],
)
def test_a_wrong_base_is_refused(text, reason, write):
    with pytest.raises(ConfigurationError, match=reason):
        load_scenario(write(text))


def test_values_come_with_their_source(write, capsys):
    assert main(["check", write(MINE), "--set", "controller.algorithm=coast", "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    controller = found["parameters"]["/deputy1/controller"]
    sources = {
        name: controller[name]["source"] for name in ("tick", "lqr.thrust", "algorithm", "mass", "handover_step")
    }
    assert sources == {
        "tick": "mine /**",
        "lqr.thrust": "mine /deputy1/controller",
        "algorithm": "command line",
        "mass": "the plant's",
        "handover_step": "default",
    }
    assert controller["lqr.thrust"] == {"value": [0.001, 0.001, 0.001], "unit": "N", "source": sources["lqr.thrust"]}


def test_notes_name_blind_directions_slow_sampling_and_passive_safety():
    scenario = load_scenario(
        "leader_follower",
        {
            "/**": {"tick": 10.0},
            "/**/controller": {"lqr.position_error": [0.001] * 3, "lqr.thrust": [1.0] * 3},
        },
    )
    blind, slow, unsafe = notes(scenario)
    words = "radius, range_rate, latitude leave a direction unobserved, mostly cross-track"
    assert blind == f"navigation of deputy1: {words}"
    assert slow.startswith("controller of deputy1: tick 10 s is slow for its fastest pole")
    assert unsafe.endswith("where a drift along it may collide: chief and deputy1 (0.0 m)")


def test_a_scenario_that_cannot_be_flown_is_refused(write, capsys):
    assert main(["check", write("extends: leader_follower\n/plant:\n  ros__parameters: {duration: -1 h}\n")]) == 2
    assert "parameter duration: -3600.0 is not allowed; it must be above 0" in capsys.readouterr().err
