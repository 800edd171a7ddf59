"""Flights in-process with faults between plant and modules, watched by the monitors."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from formation_gnc.parameters import dump, load
from formation_gnc.records import Measurement
from formation_gnc.sil.following import SHARED, with_followed
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, load_scenario
from formation_gnc.supervision.health import Health
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Level
from formation_gnc.supervision.parameters import SupervisorParameters

DEPUTY = "deputy1"

type Corrupt = Callable[[Measurement, int], Measurement]
"""Of a measurement and the ticks since the fault began, from 0 on."""


def supervisor_parameters(scenario: Scenario, **changes: Any) -> SupervisorParameters:
    """What a supervisor in this scenario has, and what it follows of the plant."""
    plant = dump(scenario.plant)
    shared = {name: value for name, value in plant.items() if name in SHARED}
    values = with_followed(SupervisorParameters, shared | changes, plant, DEPUTY)
    return load(SupervisorParameters, values)


def with_fault(run: Run, onset: int, corrupt: Corrupt) -> None:
    """Corrupt what the plant measures, from a tick on, before any module has it."""
    measure = run.plant.measure

    def corrupted() -> dict[str, Measurement]:
        measurements = measure()
        if run.plant.tick >= onset:
            measurements[DEPUTY] = corrupt(measurements[DEPUTY], run.plant.tick - onset)
        return measurements

    run.plant.measure = corrupted  # type: ignore[method-assign]


@dataclass
class Flight:
    """A flight with the verdicts on it."""

    failed: dict[tuple[str, str], int] = field(default_factory=dict)
    """Tick of the first failure by monitor and subject."""

    def delay(self, monitor: str, subject: str, onset: int) -> int:
        """Ticks from the onset of a fault to its detection."""
        return self.failed[monitor, subject] - onset


Watch = Callable[..., Flight]


@pytest.fixture(scope="session")
def watch() -> Watch:
    """Fly a scenario for some ticks, by default to the end, with a fault of the plant or another one from a tick on."""

    def watch(
        name: str,
        seed: int = 1,
        ticks: int | None = None,
        onset: int = 0,
        corrupt: Corrupt | None = None,
        fault: str = "",
    ) -> Flight:
        faults = [f"{{at: {onset}.0, deputy: {DEPUTY}, {fault}}}"] if fault else []
        scenario = load_scenario(name, {"/plant": {"seed": seed, "faults": faults}})
        run, health, flight = Run(scenario), Health(supervisor_parameters(scenario)), Flight()
        if corrupt is not None:
            with_fault(run, onset, corrupt)
        records: dict[str, Any] = {}
        topics = [f"/{DEPUTY}/{topic}" for topic in ("measurement", "estimate", "target", "status", "thrust")]
        while not run.plant.finished and run.plant.tick != ticks:
            records.clear()
            tick, time = run.plant.tick, run.plant.time
            run.tick(records.__setitem__)
            health.feed(time, Mode.KEEP if tick > 600 else Mode.ACQUIRE, *map(records.get, topics))
            for verdict in health.verdicts():
                if verdict.level is Level.FAILED:
                    flight.failed.setdefault((verdict.monitor, verdict.subject), tick)
        return flight

    return watch
