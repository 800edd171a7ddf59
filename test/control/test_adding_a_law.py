"""A law is one file and one registry entry: a toy law, added as a plug-in would add it."""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from formation_gnc.analysis.design_report import design
from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.parameters import dump, load, parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from tools import write_reference


@dataclass(frozen=True)
class ProportionalDerivativeParameters:
    """Poles of the closed loop on a double integrator."""

    natural_frequency: float = parameter(0.01, unit="rad/s", above=0.0, in_flight=True, doc="natural frequency")
    damping: float = parameter(1.0, minimum=0.0, in_flight=True, doc="damping ratio")


class ProportionalDerivative(Controller[ProportionalDerivativeParameters]):
    """PD control of each axis as a double integrator: u = -w^2 dr - 2 zeta w dv."""

    Parameters = ProportionalDerivativeParameters

    def __init__(
        self, parameters: ProportionalDerivativeParameters, common: CommonParameters, vehicle: Vehicle
    ) -> None:
        """Compute the gain; raises DesignError for an undamped loop."""
        if parameters.damping == 0.0:
            raise DesignError("pd: damping is 0; it must be above 0 for a stable loop")
        frequency = parameters.natural_frequency
        self.gain = np.hstack([frequency**2 * np.eye(3), 2.0 * parameters.damping * frequency * np.eye(3)])
        self.activations = list[Handover]()

    def activate(self, handover: Handover) -> None:
        """Note the handover."""
        self.activations.append(handover)

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force for the current error."""
        return Command(-estimate.mass * self.gain @ (estimate.relative_state - target.relative_state))

    def figures(self) -> dict[str, Any]:
        """The position gain."""
        return {"position gain [1/s^2]": float(self.gain[0, 0])}


@pytest.fixture(autouse=True)
def _registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(ALGORITHMS, "pd", ProportionalDerivative)


VALUES = {"chief.semi_major_axis": 6978100.0, "tick": 10.0}
AWAY = np.array([5.0, -8.0, 3.0, 0.0, 0.0, 0.0])


def test_its_parameters_join_the_schema_of_the_controller():
    parameters = load(ControllerParameters, VALUES | {"algorithm": "pd", "pd.damping": 0.7})
    assert parameters.laws["pd"] == ProportionalDerivativeParameters(damping=0.7)
    assert dump(parameters)["pd.natural_frequency"] == 0.01
    with pytest.raises(ConfigurationError, match=r"parameter pd\.damping: -1\.0 is not allowed"):
        load(ControllerParameters, VALUES | {"pd.damping": -1.0})


def test_the_reference_page_lists_its_parameters():
    page = write_reference.parameters_page()
    assert "| `pd.natural_frequency` | double | rad/s | `0.01` | above 0 | natural frequency | yes |" in page
    assert "adaptive_lqr, pd | active control law |" in page


def test_a_swap_to_it_in_flight_starts_from_the_force_before(estimate, target):
    manager = ControllerManager("/deputy1/controller", load(ControllerParameters, VALUES))
    before, _ = manager.on_tick(estimate(AWAY), target())
    manager.commit(manager.stage({"algorithm": "pd", "pd.natural_frequency": 1e-3}))
    after, status = manager.on_tick(estimate(AWAY, 10.0), target(time=10.0))
    law = manager.configuration.design
    assert isinstance(law, ProportionalDerivative)
    (handover,) = law.activations
    assert handover.algorithm == "lqr"
    np.testing.assert_array_equal(handover.force, before.force)
    assert status.algorithm == "pd"
    np.testing.assert_allclose(status.demand, -1e-6 * 100.0 * AWAY[:3], rtol=1e-12)
    assert np.abs(after.force - before.force).max() <= 0.1 * 0.01 * (1.0 + 1e-12)  # one handover step


def test_an_inadmissible_design_of_it_is_rejected_in_flight():
    manager = ControllerManager("/deputy1/controller", load(ControllerParameters, VALUES))
    with pytest.raises(DesignError, match="pd: damping is 0; it must be above 0"):
        manager.stage({"algorithm": "pd", "pd.damping": 0.0})


def test_it_controls_a_whole_run_after_a_scheduled_swap():
    swap = "{at: 100.0, algorithm: pd, pd.natural_frequency: 0.003}"
    overrides = {"/plant": {"duration": 2400.0}, "/**/controller": {"schedule": [swap], "algorithm": "coast"}}
    records = defaultdict[str, list[Any]](list)
    Run(load_scenario("leader_follower", overrides)).fly(lambda topic, record: records[topic].append(record))
    assert [status.algorithm for status in records["/deputy1/status"]] == ["coast"] * 100 + ["pd"] * 2300
    assert not any(status.fallback for status in records["/deputy1/status"])
    errors = [
        np.linalg.norm(truth.deputies[0].relative_state[:3] - aim.relative_state[:3])
        for truth, aim in zip(records["/truth"], records["/deputy1/target"], strict=True)
    ]
    assert errors[-1] < 0.1 * errors[0]


def test_its_design_is_reported():
    parameters = load(ControllerParameters, VALUES | {"algorithm": "pd"})
    assert design(parameters).figures == {"position gain [1/s^2]": pytest.approx(1e-4)}
