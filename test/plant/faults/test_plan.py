"""Entries of planned faults: each refusal names entry, field, value and what is allowed."""

from dataclasses import MISSING
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import Leaf, leaves, load
from formation_gnc.plant.faults.fault import Fault
from formation_gnc.plant.faults.plan import plan_faults
from formation_gnc.plant.faults.registry import FAULTS
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.types import NANOSECONDS

from .conftest import VALUES

ON = ("radius", "range_rate", "latitude")


def refusal(entry: str) -> str:
    with pytest.raises(ConfigurationError) as raised:
        load(PlantParameters, VALUES | {"faults": [entry]})
    start = f"parameter faults: {entry!r}"
    assert str(raised.value).startswith(start)
    assert "\n" not in str(raised.value)
    return str(raised.value).removeprefix(start).removeprefix(": ")


@pytest.mark.parametrize("entry", ["", "bias", "[1.0]", "{at: 1.0", "12", "null"])
def test_what_is_no_entry_is_refused_with_an_example(entry: str) -> None:
    assert refusal(entry) == (
        "is not allowed; it must be like '{at: 3000.0, until: 6000.0, deputy: deputy1, fault: bias, sensor: radius, "
        "value: 20.0}' with times in seconds"
    )


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ("", "fault: missing; known: bias, drift, "),
        ("fault: biass, sensor: radius", "fault: 'biass' is unknown; did you mean bias?"),
        ("fault: [bias]", "fault: ['bias'] is unknown; did you mean bias?"),
        ("fault: bias, sensor: radios, value: 1.0", "sensor: 'radios' is unknown; did you mean radius?"),
        (
            "fault: bias, sensor: chief_range, value: 1.0",
            "sensor: 'chief_range' is not allowed; it is off, sensors on deputy1 are: radius, range_rate, latitude",
        ),
        ("fault: bias, sensor: [radius], value: 1.0", "sensor: ['radius'] is not allowed; it must be a value of type"),
        ("fault: bias, sensor: radius", "value: missing; give a double array"),
        ("fault: bias, sensor: radius, valu: 1.0", "valu: is no field of bias; did you mean value?"),
        ("fault: bias, sensor: radius, value: .nan", "value: nan is not allowed; it must be finite"),
        ("fault: bias, sensor: radius, value: -.inf", "value: -inf is not allowed; it must be finite"),
        (
            "fault: bias, sensor: radius, value: 20 m",
            "value: '20 m': unit 'm' is not allowed; it must be a number alone",
        ),
        ("fault: bias, sensor: radius, value: [1.0, 2.0]", "value: [1.0, 2.0] is not allowed; it must be one number"),
        ("fault: drift, sensor: radius, rate: []", "rate: [] is not allowed; it must be one number"),
        ("fault: bias, sensor: radius, value: [1, 2.0]", "is not YAML as ROS 2 reads it, line 1: the values of a list"),
        (
            "fault: bias, sensor: radius, value: 1.0, value: 2.0",
            "is not YAML as ROS 2 reads it, line 1: value is given",
        ),
        ("fault: stuck_off, sensor: radius", "sensor: is no field of stuck_off; known: at, axes, deputy, told, until"),
        ("fault: mass_scale, factor: 0.0", "factor: 0.0 is not allowed; it must be above 0, at most 1e+06"),
        ("fault: noise, sensor: radius, factor: -1.0", "factor: -1.0 is not allowed; it must be at least 0"),
        ("fault: dropout, sensor: radius, share: 1.5", "share: 1.5 is not allowed; it must be above 0, at most 1"),
        ("fault: outliers, sensor: radius", "share: missing; give a double"),
        ("fault: late, sensor: radius, delay: 0.5", "delay: 0.5 s is not allowed; it must be a whole number of ticks"),
        ("fault: swap, sensor: radius, other: radius", "other: 'radius' is not allowed; it must be another sensor"),
        ("fault: swap, sensor: radius, other: chief_range", "other: 'chief_range' is not allowed; it is off, sensors"),
        ("fault: swap, sensor: radius, other: lattitude", "other: 'lattitude' is unknown; did you mean latitude?"),
        ("fault: leak, force: 0.001", "force: [0.001] is not allowed; it must be 3 values"),
        ("fault: leak, force: [0.1, .inf, 0.0]", "force: inf is not allowed; it must be finite"),
        ("fault: stuck_off, axes: [false, false, false]", "axes: [False, False, False] is not allowed; at least one"),
        (
            "fault: stuck_on, force: [0.0, 0.1, 0.0], axes: [true, false, false]",
            "force: [0.0, 0.1, 0.0] is not allowed; it must be 0 on axes that are not stuck",
        ),
        ("fault: slow, lag: 0.0", "lag: 0.0 is not allowed; it must be above 0"),
        ("fault: slow, lag: 1.0, told: maybe", "told: 'maybe' is not allowed; it must be a value of type bool"),
        ("fault: force_zero, until: 5.0", "until: 5.0 s is not allowed; it must be after at, 5.0 s"),
        ("fault: force_zero, until: 4.0", "until: 4.0 s is not allowed; it must be after at, 5.0 s"),
        ("fault: force_zero, until: .inf", "until: inf is not allowed; it must be finite"),
    ],
)
def test_a_field_that_is_not_allowed_is_refused_by_name(fields: str, words: str) -> None:
    entry = f"{{at: 5.0, deputy: deputy1{', ' if fields else ''}{fields}}}"
    assert refusal(entry).startswith(words)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{at: -1.0, deputy: deputy1, fault: force_zero}", "at: -1.0 is not allowed; it must be at least 0"),
        ("{at: soon, deputy: deputy1, fault: force_zero}", "at: 'soon' is not allowed; it must be a value of type"),
        ("{deputy: deputy1, fault: force_zero}", "at: missing; give a double"),
        ("{at: 1.0, fault: force_zero}", "deputy: missing; give a string"),
        ("{at: 1.0, deputy: deputi1, fault: force_zero}", "deputy: 'deputi1' is unknown; did you mean deputy1?"),
        (
            "{at: 0.2, until: 0.8, deputy: deputy1, fault: force_zero}",
            "until: 0.8 s is not allowed; no tick of 1 s lies",
        ),
    ],
)
def test_time_and_deputy_must_be_those_of_the_run(entry: str, words: str) -> None:
    assert refusal(entry).startswith(words)


def test_sensors_of_one_deputy_may_be_off_on_another() -> None:
    values = VALUES | {"deputy2.sensors.radius.on": False}
    entry = "{{at: 1.0, deputy: {}, fault: freeze, sensor: radius}}"
    load(PlantParameters, values | {"faults": [entry.format("deputy1")]})
    with pytest.raises(ConfigurationError, match="it is off, sensors on deputy2 are: range_rate, latitude"):
        load(PlantParameters, values | {"faults": [entry.format("deputy2")]})


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_has_a_meaning_and_its_fields_have(name: str) -> None:
    assert str(FAULTS[name].__doc__).splitlines()[0].endswith(".")
    for leaf in leaves(FAULTS[name], {}):
        assert leaf.limits.doc
        if leaf.default is not MISSING and leaf.name != "until":
            assert leaf.check(leaf.default) == leaf.default


COMMON = {leaf.name for leaf in leaves(Fault, {})}


def values_of(leaf: Leaf) -> st.SearchStrategy[Any]:
    """Allowed values of a field, well inside its range where it is a number."""
    if leaf.name in ("sensor", "other"):
        return st.sampled_from(ON)
    if leaf.name == "delay":
        return st.integers(1, 60).map(float)
    limits = leaf.limits
    scalar = (
        st.booleans()
        if leaf.type_name.startswith("bool")
        else st.floats(max(limits.minimum, limits.above, -1e3), min(limits.maximum, 1e3), exclude_min=True)
    )
    if not leaf.type_name.endswith("array"):
        return scalar
    return st.lists(scalar, min_size=limits.length or 1, max_size=limits.length or 1)


@st.composite
def entries(draw: st.DrawFn, latest: float = 100.0) -> dict[str, Any]:
    """Fields of a valid entry."""
    name = draw(st.sampled_from(sorted(FAULTS)))
    begin = draw(st.floats(0.0, latest))
    fields = {leaf.name: draw(values_of(leaf)) for leaf in leaves(FAULTS[name], {}) if leaf.name not in COMMON}
    if "axes" in fields:
        fields["axes"] = [True, *fields["axes"][1:]]
    if name == "stuck_on":
        fields["force"] = [each if axis else 0.0 for each, axis in zip(fields["force"], fields["axes"], strict=True)]
    if "other" in fields:
        fields["other"] = draw(st.sampled_from([each for each in ON if each != fields["sensor"]]))
    until = {"until": begin + draw(st.floats(2.0, latest))} if draw(st.booleans()) else {}
    return {"at": begin, **until, "deputy": draw(st.sampled_from(VALUES["deputies"])), "fault": name, **fields}


def text_of(fields: dict[str, Any]) -> str:
    return f"{{{', '.join(f'{name}: {text(value)}' for name, value in fields.items())}}}"


def text(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(text, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


@given(entries())
def test_a_valid_entry_is_read_as_it_was_written(fields: dict[str, Any]) -> None:
    parameters = load(PlantParameters, VALUES | {"faults": [text_of(fields)]})
    (planned,) = parameters.planned_faults
    assert planned.name == fields.pop("fault")
    assert all(
        getattr(planned.fault, name) == (tuple(value) if isinstance(value, list) else value)
        for name, value in fields.items()
    )
    assert planned.fault.words


@given(entries(), st.integers(1, 10 * NANOSECONDS))
def test_a_fault_holds_at_the_ticks_from_its_begin_to_its_end(fields: dict[str, Any], tick_ns: int) -> None:
    deputies = load(PlantParameters, VALUES).deputy
    if fields["fault"] == "late":
        fields["delay"] = tick_ns / NANOSECONDS
    try:
        (planned,) = plan_faults([text_of(fields)], deputies, tick_ns)
    except ConfigurationError:
        first = -(-round(fields["at"] * NANOSECONDS) // tick_ns)
        assert round(fields["until"] * NANOSECONDS) <= first * tick_ns, "refused, though there is a tick between"
        return
    begin = round(planned.fault.at * NANOSECONDS)
    assert (planned.begin - 1) * tick_ns < begin <= planned.begin * tick_ns
    if "until" in fields:
        assert (planned.end - 1) * tick_ns < round(planned.fault.until * NANOSECONDS) <= planned.end * tick_ns
