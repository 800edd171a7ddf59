"""Who may do what on a graph: what the modules of the shipped scenarios do, and no more."""

from collections.abc import Sequence

import pytest

from formation_gnc.flight.access import LAUNCHER, OPERATOR, SETTING, Access, access_by_process
from formation_gnc.flight.graph import GRAPH, ModuleInstance
from formation_gnc.sil.scenario import load_scenario

FLEET = ("one", "two", "three")


@pytest.fixture
def accesses() -> dict[str, Access]:
    return access_by_process(FLEET)


def publishers(accesses: dict[str, Access], topic: str) -> list[str]:
    return sorted(name for name, access in accesses.items() if topic in access.publishes)


@pytest.mark.parametrize("name", ["leader_follower", "bad_day", "tetrahedral"])
def test_modules_may_publish_and_hear_what_they_do_and_nothing_else(name: str) -> None:
    scenario = load_scenario(name)
    accesses = access_by_process(scenario.plant.deputies)
    for deputy in scenario.plant.deputies:
        for row in GRAPH:
            module = ModuleInstance(row, deputy, scenario.deputies[deputy][row.name])
            access = accesses[module.node]
            of_every_node = {f"/{deputy}/timing", "/events", "/diagnostics"}
            assert access.publishes == {topic.of(deputy) for topic in module.published()} | of_every_node
            assert access.subscribes == module.inputs.keys()


def test_only_a_deputys_controller_commands_its_thrust(accesses: dict[str, Access]) -> None:
    for deputy in FLEET:
        assert publishers(accesses, f"/{deputy}/thrust") == [f"/{deputy}/controller", f"/{deputy}/satellite"]


@pytest.mark.parametrize("topic", ["/clock", "/truth", "/two/measurement"])
def test_only_the_plant_tells_time_truth_and_measurements(accesses: dict[str, Access], topic: str) -> None:
    assert publishers(accesses, topic) == ["/plant"]


def test_a_deputy_hears_of_others_their_estimates_alone(accesses: dict[str, Access]) -> None:
    heard = {each for each in accesses["/one/satellite"].subscribes if not each.startswith("/one/")}
    assert heard == {"/two/estimate", "/three/estimate"}
    assert heard <= accesses["/one/guidance"].subscribes


def test_a_composed_satellite_may_do_what_its_modules_may(accesses: dict[str, Access]) -> None:
    satellite = accesses["/two/satellite"]
    for row in GRAPH:
        assert accesses[f"/two/{row.name}"] | satellite == satellite


def test_only_an_operator_changes_parameters(accesses: dict[str, Access]) -> None:
    commanded = {f"{node}/{service}" for node in ("/plant", "/one/controller", "/recorder") for service in SETTING}
    assert commanded <= accesses[OPERATOR].calls
    for name, access in accesses.items():
        if name != OPERATOR:
            assert not {each for each in access.calls if "set_" in each}


def test_who_looks_on_publishes_nothing(accesses: dict[str, Access]) -> None:
    assert accesses[OPERATOR].publishes == accesses[LAUNCHER].publishes == frozenset()
    assert accesses["/recorder"].publishes == {"/recorder/progress", "/events", "/diagnostics"}


def test_a_formation_in_a_namespace_is_kept_to_it() -> None:
    accesses = access_by_process(["one"], "/north")
    controller = accesses["/north/one/controller"]
    assert controller.subscribes == {"/north/one/estimate", "/north/one/target", "/north/one/mode"}
    assert controller.publishes > {"/north/one/thrust", "/north/events", "/diagnostics"}
    assert all(each.startswith("/north/one/controller/") for each in controller.serves)
    assert "/north/plant/set_parameters" in accesses[OPERATOR].calls


@pytest.mark.parametrize("deputies", [["one"], FLEET])
def test_what_a_fleet_alone_has_is_granted_in_a_fleet_alone(deputies: Sequence[str]) -> None:
    assert ("/one/separation" in access_by_process(deputies)["/one/guidance"].publishes) is (len(deputies) > 1)
