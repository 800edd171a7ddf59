"""Checks of a fleet's guidance parameters before the run."""

from typing import Any

import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.fleet_checks import check_fleet
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.parameters import load

FLEET = ("deputy1", "deputy2", "deputy3", "deputy4")
RING = {"formation": "projected_circular_orbit", "projected_circular_orbit.satellites": 4}


def parameters(**values: Any) -> GuidanceParameters:
    return load(GuidanceParameters, {"chief.semi_major_axis": 7.0e6} | values)


def member(**values: Any) -> GuidanceParameters:
    """Parameters of one of a fleet on a ring."""
    return parameters(fleet=FLEET, **RING, **values)


def test_two_satellites_in_one_slot_now_or_later_are_rejected() -> None:
    def satellite(slot: int, **values: Any) -> GuidanceParameters:
        return parameters(formation="tetrahedral", slot=slot, **values)

    check_fleet({"a": satellite(0), "b": satellite(1), "c": satellite(2), "d": satellite(3)})
    with pytest.raises(ConfigurationError, match=r"a and c are in one slot from 0 s: tetrahedral, slot 2"):
        check_fleet({"a": satellite(2), "b": satellite(1), "c": satellite(2)})
    later = satellite(0, schedule=["{at: 60, slot: 1}"])
    with pytest.raises(ConfigurationError, match=r"a and b are in one slot from 60 s"):
        check_fleet({"a": later, "b": satellite(1)})


def test_fleet_with_differing_parameters_is_rejected() -> None:
    assigned = member(assignment="delta_v")
    check_fleet(dict.fromkeys(FLEET, assigned))
    check_fleet(dict.fromkeys(FLEET, assigned) | {"deputy4": member(assignment="delta_v", slot=3)})
    with pytest.raises(ConfigurationError, match="must be the same"):
        check_fleet(dict.fromkeys(FLEET, assigned) | {"deputy4": member(slot=3)})
    with pytest.raises(ConfigurationError, match="deputy4, who must be"):
        check_fleet(dict.fromkeys(FLEET[:3], assigned))
    with pytest.raises(ConfigurationError, match="in one slot"):
        check_fleet(dict.fromkeys(FLEET, member()))
