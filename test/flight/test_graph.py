"""The graph table."""

import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.graph import GRAPH, Row, modules_named
from formation_gnc.flight.module import FlightModule, ModuleParameters


@pytest.mark.parametrize("row", GRAPH, ids=lambda row: row.name)
def test_every_row_names_a_flight_module_and_its_schema(row: Row) -> None:
    assert issubclass(row.module, FlightModule)
    assert issubclass(row.parameters, ModuleParameters)


def test_modules_are_named_in_the_order_of_a_tick() -> None:
    assert [row.name for row in modules_named(["controller", "navigation"])] == ["navigation", "controller"]
    with pytest.raises(ConfigurationError, match="nodes thruster: must be some of navigation"):
        modules_named(["thruster"])
    with pytest.raises(ConfigurationError, match="nodes none"):
        modules_named([])
