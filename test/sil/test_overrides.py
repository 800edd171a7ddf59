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


def test_the_later_of_two_values_counts() -> None:
    assert overrides_of(["plant.seed=1", "plant.seed=2"]) == {"/plant": {"seed": 2}}


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
