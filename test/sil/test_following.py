"""What stands in the plant's section holds for navigation, guidance and controller, unless they are told otherwise."""

from dataclasses import MISSING
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.flight.graph import GRAPH, MODULES, Row
from formation_gnc.parameters import leaves
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.sil.following import leader_of
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, find_scenario, load_scenario

SHIPPED = sorted(path.stem for path in find_scenario("leader_follower").parent.glob("*.yaml"))


def flown_with(**plant: Any) -> Scenario:
    """The default scenario with values of its deputy in the plant, `__` for dots."""
    return load_scenario(
        "leader_follower", {"/plant": {f"deputy1.{name.replace('__', '.')}": each for name, each in plant.items()}}
    )


@pytest.mark.parametrize("row", GRAPH, ids=lambda row: row.name)
def test_a_follower_has_unit_and_default_of_the_plants_parameter(row: Row) -> None:
    plant = {leaf.name: leaf for leaf in leaves(PlantParameters, {})}
    followers = [leaf for leaf in leaves(row.parameters, {}) if leader_of(leaf, "deputy1")]
    assert {"tick", "chief.semi_major_axis"} < {leaf.name for leaf in followers}
    for leaf in followers:
        leader = leader_of(leaf, "deputy1")
        if "*" in leader:
            names = [name for name in plant if name.startswith("deputy1.sensors.") and name.endswith(".on")]
            assert leaf.default == tuple(name.split(".")[2] for name in names if plant[name].default)
            continue
        one = plant[leader.replace("{fleet}", "deputy1")]
        assert (leaf.limits.unit, leaf.type_name.removesuffix(" array")) == (
            one.limits.unit,
            one.type_name.removesuffix(" array"),
        )
        # one that has to be given to the plant may have a default elsewhere, for a node on its own
        assert one.default is MISSING or leaf.default in (one.default, ()), leaf.name


def test_modules_take_what_the_plant_says_of_their_deputy() -> None:
    plant = {
        "epoch": 1e8,  # which the file gives nobody
        "deputy1.mass": 80,
        "deputy1.thrusters.limit": [0.02, 0.03, 0.0],
        "deputy1.thrusters.total_limit": 0.03,
        "deputy1.thrusters.off_in_eclipse": True,
        "deputy1.sensors.radius.sigma": 12.0,
        "deputy1.sensors.latitude.on": False,
        "deputy1.sensors.chief_range.on": True,
        "deputy1.sensors.fix_velocity_sigma": 0.01,
    }
    scenario = load_scenario("leader_follower", {"/plant": plant})
    modules = scenario.deputies["deputy1"]
    for each in modules.values():
        assert each.epoch == 1e8
    navigation, guidance, controller = modules["navigation"], modules["guidance"], modules["controller"]
    assert navigation.sigmas == {"radius": (12.0,), "range_rate": (0.01,), "chief_range": (1.0,)}
    assert navigation.fix_velocity_sigma == 0.01
    assert (controller.mass, controller.thrust_limit) == (80.0, (0.02, 0.03, 0.0))
    assert guidance.thrust_limit == (0.02, 0.03, 0.0)
    assert (controller.laws["mpc"].total_thrust, controller.laws["mpc"].off_in_eclipse) == (0.03, True)
    assert scenario.departures() == []


def test_each_deputy_follows_its_own_part_of_the_plant() -> None:
    plant = {"deputy2.mass": 50.0, "deputy3.thrusters.dry_mass": 90.0}
    scenario = load_scenario("tetrahedral", {"/plant": plant})
    assert [each["controller"].mass for each in scenario.deputies.values()] == [100.0, 50.0, 100.0, 100.0]
    assert scenario.deputies["deputy1"]["guidance"].dry_masses == (0.0, 0.0, 90.0, 0.0)


def test_a_value_that_is_given_wins_and_the_difference_is_told() -> None:
    overrides: dict[str, dict[str, Any]] = {
        "/plant": {"deputy1.sensors.radius.sigma": 10.0, "tick": 1.0},
        "/deputy1/navigation": {"radius_sigma": 5.0, "sensors": ["radius", "latitude"]},
        "/**/controller": {"mass": 90.0, "tick": 2.0},
    }
    scenario = load_scenario("leader_follower", overrides)
    modules = scenario.deputies["deputy1"]
    assert (modules["navigation"].radius_sigma, modules["controller"].mass) == (5.0, 90.0)
    assert scenario.departures() == [
        "/deputy1/navigation: sensors is ['radius', 'latitude'], the plant's deputy1.sensors.*.on "
        "['radius', 'range_rate', 'latitude']; "
        "radius_sigma is 5.0 m, the plant's deputy1.sensors.radius.sigma 10.0 m",
        "/deputy1/controller: tick is 2.0 s, the plant's tick 1.0 s; "
        "mass is 90.0 kg, the plant's deputy1.mass 100.0 kg",
    ]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_say_nothing_twice(name: str) -> None:
    assert load_scenario(name).departures() == []
    sections = find_scenario(name).read_text().split("\n/")
    for row in MODULES.values():
        own = "".join(each for each in sections if each.startswith(f"**/{row.name}:"))
        followers = [leaf.name for leaf in leaves(row.parameters, {}) if leaf.limits.follows]
        assert [name for name in followers if f" {name}:" in own] == []


def test_a_follower_stays_within_its_own_range() -> None:
    """A perfect sensor is to the filter the best that it allows."""
    scenario = flown_with(sensors__radius__sigma=0.0)
    assert scenario.deputies["deputy1"]["navigation"].radius_sigma == 1e-6
    assert scenario.departures() == []


def test_without_a_sensor_the_filter_has_its_own_default() -> None:
    off = {f"sensors__{name}__on": False for name in ("radius", "range_rate", "latitude")}
    assert flown_with(**off).deputies["deputy1"]["navigation"].sensors == ("radius", "range_rate", "latitude")


def test_a_satellite_without_thrusters_coasts() -> None:
    overrides = {"/plant": {"deputy1.thrusters.limit": [0.0] * 3, "duration": 3.0}}
    scenario = load_scenario("leader_follower", {**overrides, "/**/controller": {"algorithm": "coast"}})
    Run(scenario).fly(lambda *_: None)
    with pytest.raises(ValueError, match=r"thrust_limit: \[0.0, 0.0, 0.0\] is not allowed; one axis must push"):
        load_scenario("leader_follower", overrides)


def test_a_scenario_written_and_read_again_keeps_its_differences(tmp_path: Path) -> None:
    scenario = load_scenario("leader_follower", {"/**/controller": {"mass": 90.0}})
    (tmp_path / "leader_follower.yaml").write_text(scenario.text())
    assert load_scenario(str(tmp_path / "leader_follower.yaml")).departures() == scenario.departures() != []
