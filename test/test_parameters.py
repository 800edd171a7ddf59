import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import change, dump, leaves, load, parameter, per_entry, per_name, read_yaml


@dataclass(frozen=True)
class Dish:
    gain: float = parameter(doc="gain")
    width: float = parameter(0.5, unit="m", above=0.0, maximum=4.0, doc="diameter", in_flight=True)


@dataclass(frozen=True)
class Station:
    masts: int = parameter(1, minimum=0, doc="masts")
    site: tuple[float, ...] = parameter((0.0, 0.0), length=2, minimum=-90.0, maximum=90.0, doc="where it stands")


@dataclass(frozen=True)
class Network:
    name: str = parameter(doc="name of the network")
    band: str = parameter("S", choices=("S", "X"), in_flight=True, doc="band")
    channels: int = parameter(4, minimum=1, maximum=64, in_flight=True, doc="channels")
    open: bool = parameter(False, doc="whether anybody may use it")
    weights: tuple[float, ...] = parameter((), in_flight=True, doc="weights")
    up: Dish = Dish(gain=10.0)
    down: Dish = Dish(width=2.0, gain=30.0)
    stations: tuple[str, ...] = parameter(("kiruna",), doc="names of the stations")
    station: dict[str, Station] = per_name("stations")


finite = st.floats(allow_nan=False, allow_infinity=False)
allowed = st.fixed_dictionaries(
    {"name": st.text()},
    optional={
        "band": st.sampled_from(["S", "X"]),
        "channels": st.integers(1, 64),
        "open": st.booleans(),
        "weights": st.lists(finite),
        "up.width": st.floats(0.0, 4.0, exclude_min=True),
        "down.gain": finite,
        "kiruna.masts": st.integers(0, 2**63 - 1),
        "kiruna.site": st.lists(st.floats(-90.0, 90.0), min_size=2, max_size=2),
    },
)


@settings(deadline=None)
@given(allowed)
def test_allowed_values_are_loaded_and_dumped_unchanged(values: dict[str, Any]) -> None:
    network = load(Network, values)
    flat = dump(network)
    plain = {name: list(value) if isinstance(value, tuple) else value for name, value in flat.items()}
    assert plain | values == plain
    assert load(Network, flat) == network


anything = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.integers(min_value=10**400)
    | st.floats()
    | st.text()
    | st.binary()
    | st.dates(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@settings(deadline=None)
@given(st.sampled_from(sorted(dump(load(Network, {"name": "near"})))), anything)
def test_any_value_is_in_range_or_rejected_by_name(name: str, value: Any) -> None:
    values = {"name": "near", name: value}
    try:
        network = load(Network, values)
    except ConfigurationError:
        with pytest.raises(ConfigurationError, match=f"^parameter {name}: "):
            load(Network, values)
        return
    flat = dump(network)
    numbers = [each for values in flat.values() for each in np.ravel(values) if not isinstance(each, str)]
    assert all(math.isfinite(number) for number in numbers)
    assert 1 <= network.channels <= 64
    assert 0.0 < network.up.width <= 4.0
    assert network.band in ("S", "X")
    assert all(len(station.site) == 2 and station.masts >= 0 for station in network.station.values())


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("channels", 0, "0 is not allowed; it must be at least 1, at most 64"),
        ("channels", 65, "65 is not allowed; it must be at least 1, at most 64"),
        ("channels", 4.0, "4.0 is not allowed; it must be a value of type integer"),
        ("channels", True, "True is not allowed; it must be a value of type integer"),
        (
            "channels",
            2**63,
            "9223372036854775808 is not allowed; it must be within 64 bits, as ROS carries it",
        ),
        ("up.width", 0.0, "0.0 is not allowed; it must be above 0, at most 4"),
        ("up.width", math.nan, "nan is not allowed; it must be finite"),
        ("up.width", math.inf, "inf is not allowed; it must be finite"),
        ("up.width", False, "False is not allowed; it must be a value of type double"),
        ("up.width", "0.5", "'0.5' is not allowed; it must be a value of type double"),
        ("up.width", None, "None is not allowed; it must be a value of type double"),
        ("band", "Ka", "'Ka' is not allowed; it must be one of S, X"),
        ("open", 1, "1 is not allowed; it must be a value of type bool"),
        ("weights", 3.0, "3.0 is not allowed; it must be a list (double array)"),
        ("weights", "123", "'123' is not allowed; it must be a list (double array)"),
        ("weights", [1.0, math.nan], "nan is not allowed; it must be finite"),
        ("kiruna.site", [1.0], "[1.0] is not allowed; it must be 2 values, at least -90, at most 90"),
        ("kiruna.site", [1.0, 91.0], "91.0 is not allowed; it must be 2 values, at least -90, at most 90"),
        ("kirunna.masts", 2, "unknown; did you mean kiruna.masts?"),
    ],
)
def test_a_rejection_names_the_parameter_the_value_and_what_is_allowed(name: str, value: Any, words: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        load(Network, {"name": "near", name: value})
    assert str(rejection.value) == f"parameter {name}: {words}"


def test_an_unknown_name_is_rejected_with_the_known_ones() -> None:
    with pytest.raises(ConfigurationError, match=r"parameter zzz: unknown; known: band, channels, down\.gain, .*"):
        load(Network, {"name": "near", "zzz": 1})


def test_a_parameter_without_default_is_required() -> None:
    with pytest.raises(ConfigurationError, match="parameter name: missing; give a string"):
        load(Network, {})


def test_an_integer_is_converted_to_double() -> None:
    width = load(Network, {"name": "near", "up.width": 3}).up.width
    assert (width, type(width)) == (3.0, float)


def test_nested_schemas_of_one_type_have_their_own_defaults() -> None:
    network = load(Network, {"name": "near", "up.width": 1.0})
    assert (network.up, network.down) == (Dish(10.0, 1.0), Dish(30.0, 2.0))


def test_only_listed_names_have_parameters() -> None:
    values = {"name": "near", "stations": ["oslo", "lima"], "lima.masts": 3}
    assert load(Network, values).station == {"oslo": Station(), "lima": Station(masts=3)}
    with pytest.raises(ConfigurationError, match=r"parameter kiruna\.masts: unknown"):
        load(Network, values | {"kiruna.masts": 1})


def test_leaves_have_the_type_names_of_ros() -> None:
    types = {leaf.name: leaf.type_name for leaf in leaves(Network, {})}
    assert (
        types
        | {
            "name": "string",
            "channels": "integer",
            "open": "bool",
            "up.width": "double",
            "weights": "double array",
            "stations": "string array",
        }
        == types
    )


def test_a_change_in_flight_leaves_the_original_unchanged() -> None:
    network = load(Network, {"name": "near"})
    changed = change(network, {"band": "X", "up.width": 1})
    assert (changed.band, changed.up.width, changed.channels) == ("X", 1.0, network.channels)
    assert network == load(Network, {"name": "near"})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"band": "X", "open": True}, "parameter open: cannot change in flight; set it at the start"),
        ({"channels": 0}, "parameter channels: 0 is not allowed; it must be at least 1, at most 64"),
        ({"weights": [math.inf]}, "parameter weights: inf is not allowed; it must be finite"),
        ({"bnd": "X"}, "parameter bnd: unknown; did you mean band?"),
        ({"kiruna.site": [0.0]}, "parameter kiruna.site: [0.0] is not allowed; it must be 2 values"),
    ],
)
def test_a_change_that_is_not_allowed_has_a_reason(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        change(load(Network, {"name": "near"}), changes)
    assert str(rejection.value).startswith(words)


def test_a_fixed_parameter_may_be_set_to_its_own_value() -> None:
    network = load(Network, {"name": "near"})
    assert change(network, {"open": False, "kiruna.site": np.zeros(2).tolist(), "up.gain": 10}) == network


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-6", 1e-6),
        ("-1E+3", -1e3),
        (".5e2", 50.0),
        ("2.e1", 20.0),
        ("1.0e-6", 1e-6),
        ("12", 12),
        ("1e", "1e"),
        ("e5", "e5"),
    ],
)
def test_numbers_are_read_as_in_ros(text: str, value: Any) -> None:
    read = read_yaml(text)
    assert (read, type(read)) == (value, type(value))


@dataclass(frozen=True)
class Mast:
    height: float = parameter(10.0, unit="m", above=0.0, in_flight=True, doc="height")


@dataclass(frozen=True)
class Ground:
    depth: float = parameter(1.0, unit="m", in_flight=True, doc="depth of the foundation")
    soil: str = parameter("rock", doc="soil")


class OnMast:
    Parameters = Mast


class OnGround:
    Parameters = Ground


MOUNTS: dict[str, Any] = {"mast": OnMast}


@dataclass(frozen=True)
class Site:
    mount: str = parameter("mast", choices=MOUNTS, in_flight=True, doc="mount in use")
    mounts: dict[str, Any] = per_entry(MOUNTS)


def test_a_schema_has_the_parameters_of_every_registry_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    before = load(Site, {"mast.height": 3.0})
    assert before == Site(mounts={"mast": Mast(3.0)})
    assert Site() == load(Site, {})
    with pytest.raises(ConfigurationError, match=r"mount: 'ground' is not allowed; it must be one of mast$"):
        load(Site, {"mount": "ground"})
    monkeypatch.setitem(MOUNTS, "ground", OnGround)
    after = change(before, {"mount": "ground", "ground.depth": 2.0, "ground.soil": "rock"})
    assert dump(after) == {"mount": "ground", "mast.height": 3.0, "ground.depth": 2.0, "ground.soil": "rock"}
    assert [leaf.name for leaf in leaves(Site, {})] == list(dump(after))
    with pytest.raises(ConfigurationError, match=r"parameter ground\.soil: cannot change in flight"):
        change(before, {"ground.soil": "sand"})
