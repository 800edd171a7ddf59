"""Parameters beside a scenario."""

import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.sil.overrides import overrides_of
from formation_gnc.sil.scenario import load_scenario


def test_overrides_reach_the_node_that_they_name() -> None:
    entries = [
        "deputy1/controller.lqr.thrust=[2e-4, 2e-4, 2e-4]",
        "controller.algorithm=mpc",
        "controller.lqr.thrust=[1e-4, 1e-4, 1e-4]",
        "plant.seed=7",
        "/**.tick=2",
    ]
    scenario = load_scenario("leader_follower", overrides_of(entries))
    controller = scenario.deputies["deputy1"]["controller"]
    assert (controller.algorithm, controller.laws["lqr"].thrust) == ("mpc", (2e-4,) * 3)
    assert (scenario.plant.seed, scenario.plant.tick, controller.tick) == (7, 2.0, 2.0)


def test_what_all_nodes_share_is_set_for_all_with_the_plants() -> None:
    scenario = load_scenario("leader_follower", overrides_of(["plant.tick=2", "plant.chief.eccentricity=0.01"]))
    for each in (scenario.plant, *scenario.deputies["deputy1"].values()):
        assert (each.tick, each.chief.eccentricity) == (2.0, 0.01)


def test_the_later_of_two_values_counts() -> None:
    assert overrides_of(["plant.seed=1", "plant.seed=2"]) == {"/plant": {"seed": 2}}


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("deputy9/controller.algorithm=mpc", "/deputy9/controller (did you mean /deputy1/controller?); the run has /p"),
        ("/*/controler.algorithm=mpc", "/*/controler (did you mean /**/controller?)"),
        ("/recorder.snapshot=1.0", "/recorder (did you mean"),
        ("/deputy9/**.tick=2.0", "/deputy9/** (did you mean /deputy1/"),
    ],
)
def test_an_override_of_no_node_is_rejected_like_a_section(entry: str, words: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        load_scenario("leader_follower", overrides_of([entry]))
    assert str(rejection.value).startswith("leader_follower.yaml: overrides: sections of no node: ")
    assert words in str(rejection.value)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("algorithm=mpc", "set 'algorithm=mpc': is not allowed; it must be like NODE.PARAMETER=VALUE"),
        ("controller.algorithm", "must be like NODE.PARAMETER=VALUE"),
        ("controler.algorithm=mpc", "node controler is unknown; did you mean controller?"),
        ("deputy1/plant.seed=1", "node deputy1/plant is unknown; known: controller, guidance, navigation"),
        ("controller.algorithm=", "parameter algorithm: '' is not allowed; it must be a value or a list of them"),
        ("controller.lqr={thrust: 1.0}", "parameter lqr: '{thrust: 1.0}' is not allowed"),
        ("controller.algorithm=[mpc", "parameter algorithm: '[mpc' is not YAML"),
    ],
)
def test_what_is_not_allowed_is_named(entry: str, words: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        overrides_of([entry])
    assert words in str(rejection.value)
