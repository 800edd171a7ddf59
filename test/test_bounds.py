"""Messages whose values make no sense are refused where they are decoded, whatever reads them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from formation_gnc.bounds import violation
from formation_gnc.errors import ConfigurationError
from formation_gnc.messages.conversion import received, to_cdr
from formation_gnc.mode_records import ModeState, Restriction
from formation_gnc.records import Measurement, NavigationState, Reading, Record, SatelliteTruth, Target, Truth

CHIEF = np.array([7e6, 0.0, 0.0, 0.0, 7.5e3, 0.0])
STATE = np.array([100.0, 0.0, 0.0, 0.0, 0.2, 0.0])
ESTIMATE = NavigationState(0, STATE, CHIEF, 10.0)
TARGET = Target(0, "ring", STATE, 60 * 10**9, np.tile(STATE, (3, 1)))
MEASUREMENT = Measurement(0, "deputy1", CHIEF, [Reading("radius", [7e6], 0)], np.zeros(3), 10.0, False, False, STATE)
TRUTH = Truth(0, CHIEF, [SatelliteTruth("deputy1", CHIEF, STATE, np.zeros(3), 10.0, False)])
MODE = ModeState(0, "keep", "acquire", 0, restrictions=[Restriction("sensor", "radius", "innovation")])


def with_nan(values: Any) -> Any:
    broken = np.array(values)
    broken.flat[-1] = np.nan
    return broken


@pytest.mark.parametrize("record", [ESTIMATE, TARGET, MEASUREMENT, TRUTH, MODE], ids=lambda each: type(each).__name__)
def test_what_flies_is_within_its_bounds(record: Record) -> None:
    assert violation(record) == ""


FORGED = {
    "state not finite": replace(ESTIMATE, relative_state=with_nan(STATE)),
    "state beyond any orbit": replace(ESTIMATE, relative_state=STATE * 1e20),
    "chief at zero": replace(ESTIMATE, chief_state=np.zeros(6)),
    "chief without speed across": replace(ESTIMATE, chief_state=np.array([7e6, 0.0, 0.0, 7e3, 1e-4, 0.0])),
    "chief with infinite speed": replace(ESTIMATE, chief_state=np.array([7e6, 0.0, 0.0, 0.0, np.inf, 0.0])),
    "negative mass": replace(ESTIMATE, mass=-1.0),
    "mass not finite": replace(ESTIMATE, mass=float("nan")),
    "negative preview step": replace(TARGET, preview_step=-(10**15)),
    "no preview step": replace(TARGET, preview_step=0),
    "preview not finite": replace(TARGET, preview=with_nan(TARGET.preview)),
    "endless preview": replace(TARGET, preview=np.zeros((30_000, 6))),
    "neighbour not finite": replace(TARGET, neighbours=with_nan(TARGET.preview)),
    "endless readings": replace(MEASUREMENT, readings=MEASUREMENT.readings * 2000),
    "endless reading": replace(MEASUREMENT, readings=[Reading("radius", [0.0] * 2000, 0)]),
    "endless name": replace(MEASUREMENT, deputy="x" * 5000),
    "unknown mode": replace(MODE, mode="party"),
    "endless restrictions": replace(MODE, restrictions=MODE.restrictions * 2000),
    "unknown restriction": replace(MODE, restrictions=[Restriction("planet", "radius", "")]),
    "truth not finite": replace(TRUTH, deputies=[replace(TRUTH.deputies[0], relative_state=with_nan(STATE))]),
}


@pytest.mark.parametrize("record", [record for record in FORGED.values() if not isinstance(record, NavigationState)])
def test_a_forged_message_is_refused_with_field_and_what_is_allowed(record: Record) -> None:
    with pytest.raises(ConfigurationError, match=f"message {type(record).message}: .* must be"):
        received(type(record))(to_cdr(record))


@pytest.mark.parametrize("name", [name for name, record in FORGED.items() if isinstance(record, NavigationState)])
def test_a_forged_estimate_is_out_of_bounds(name: str) -> None:
    assert "must be" in violation(FORGED[name])
