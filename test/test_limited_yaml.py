"""Hostile YAML is refused in a line, at once, by whatever reads YAML."""

from pathlib import Path

import pytest
import yaml

from formation_gnc.cli import main
from formation_gnc.errors import ParameterError
from formation_gnc.flight.schedule import parse_schedule
from formation_gnc.limited_yaml import DEEPEST, LARGEST, MOST, load_limited
from formation_gnc.parameters import read_yaml

MULTIPLYING = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "\n".join(
    f"{new}: &{new} [{', '.join([f'*{old}'] * 9)}]" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE = {
    "aliases that multiply": MULTIPLYING,
    "a mapping that contains itself": "/**: &a\n  ros__parameters: *a\n",
    "a list that contains itself": "&a [*a]",
    "an alias of nothing": "a: *b",
    "lists a thousand deep": "[" * 1000 + "]" * 1000,
    "mappings a thousand deep": "{a: " * 1000 + "1" + "}" * 1000,
    "lists a thousand deep by dashes": "- " * 1000 + "1",
    "unclosed lists": "[" * 100_000,
    "too many values": "[" + "1," * (MOST + 1) + "]",
    "too long": "#" * (LARGEST + 1),
    "a tag of Python": "!!python/object/apply:os.system [echo]",
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
@pytest.mark.parametrize("load", [load_limited, read_yaml])
def test_a_hostile_document_is_refused(load: object, text: str) -> None:
    with pytest.raises(yaml.YAMLError):
        load(text)  # type: ignore[operator]


def test_aliases_of_a_few_values_and_nesting_of_a_few_levels_are_read() -> None:
    assert load_limited("a: &a [1, 2]\nb: *a") == {"a": [1, 2], "b": [1, 2]}
    nested = load_limited("[" * (DEEPEST - 1) + "1" + "]" * (DEEPEST - 1))
    assert str(nested).count("[") == DEEPEST - 1


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hostile_parameter_file_is_one_line_and_status_two(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "hostile.yaml"
    file.write_text(text)
    assert main(["design", str(file)]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert "hostile.yaml" in errors
    assert len(errors) < 1000


@pytest.mark.parametrize("value", ["[" * 1000 + "]" * 1000, "{a: " * 500 + "1" + "}" * 500], ids=["list", "mapping"])
def test_a_schedule_nested_deeply_is_refused(value: str) -> None:
    with pytest.raises(ParameterError, match="schedule"):
        parse_schedule([f"{{at: 1.0, algorithm: {value}}}"])
