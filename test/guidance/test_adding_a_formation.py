"""A formation added by one class and one registry entry."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from formation_gnc.guidance.formation import FreeMotion
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.parameters import leaves, parameter
from formation_gnc.records import Target
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.types import Vector


@dataclass(frozen=True)
class PendulumParameters:
    """Along-track spacing and cross-track amplitude."""

    spacing: float = parameter(100.0, unit="m", in_flight=True, doc="along-track distance between the slots")
    height: float = parameter(10.0, unit="m", above=0.0, in_flight=True, doc="cross-track amplitude")


class Pendulum(FreeMotion[PendulumParameters]):
    """Slots behind the chief that oscillate across its track, z = height cos(phase)."""

    Parameters = PendulumParameters

    @staticmethod
    def slot_count(parameters: PendulumParameters) -> None:
        """Unlimited."""

    @classmethod
    def start(cls, parameters: PendulumParameters, mean_motion: float, slot: int) -> Vector:
        """At the cross-track amplitude."""
        return np.array([0.0, -(slot + 1) * parameters.spacing, parameters.height, 0.0, 0.0, 0.0])


@pytest.fixture
def _pendulum(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FORMATIONS, "pendulum", Pendulum)


@pytest.mark.usefixtures("_pendulum")
def test_added_formation_is_flown_after_a_change_in_flight() -> None:
    change = "{at: 5.0, formation: pendulum, pendulum.height: 20.0}"
    run = Run(load_scenario("leader_follower", {"/**/guidance": {"schedule": [change]}}))
    targets: list[Target] = []
    forces: list[Vector] = []

    def sink(topic: str, record: Any) -> None:
        if topic == "/deputy1/target":
            targets.append(record)
        elif topic == "/deputy1/thrust":
            forces.append(record.force)

    for _ in range(20):
        run.tick(sink)
    assert [target.formation for target in targets] == ["leader_follower"] * 5 + ["pendulum"] * 15
    phase = run.plant.parameters.mean_motion * np.arange(5, 20)
    heights = [target.relative_state[2] for target in targets[5:]]
    assert heights == pytest.approx((20.0 * np.cos(phase)).tolist(), abs=1e-9)
    assert [target.relative_state[1] for target in targets[5:]] == pytest.approx([-100.0] * 15, abs=1e-6)  # an arc
    assert forces[-1][2] > forces[4][2]  # towards the new target


@pytest.mark.usefixtures("_pendulum")
def test_added_formation_has_its_parameters_in_the_schema() -> None:
    added = {leaf.name: leaf for leaf in leaves(GuidanceParameters, {}) if leaf.name.startswith("pendulum.")}
    assert list(added) == ["pendulum.spacing", "pendulum.height"]
    assert added["pendulum.height"].default == 10.0
