"""Tables in terminals of any width."""

import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from formation_gnc.commands.tables import print_table


def printed(columns: list[list[str]], width: int) -> str:
    stream = io.StringIO()
    print_table(Console(file=stream, width=width, highlight=False), columns, "title")
    return stream.getvalue()


numbers = st.floats(-1e6, 1e6).map(lambda value: f"{value:.3f}")


@given(st.lists(st.lists(numbers, min_size=4, max_size=4), min_size=1, max_size=12), st.sampled_from([40, 80, 120]))
def test_no_digit_is_cut_and_no_line_is_too_long(values: list[list[str]], width: int) -> None:
    columns = [["figure", "one", "two", "three", "four"]]
    columns += [[f"deputy{number} [m]", *column] for number, column in enumerate(values)]
    text = printed(columns, width)
    found = re.findall(r"-?\d+\.\d{3}", text)
    assert sorted(found) == sorted(value for column in values for value in column)
    assert all(f"deputy{number} [m]" in text for number in range(len(values)))
    assert max(map(len, (line.rstrip() for line in text.splitlines()))) <= width


@pytest.mark.parametrize("width", [10, 80])
def test_a_value_wider_than_the_terminal_is_printed_whole(width: int) -> None:
    assert "1" * 100 in printed([["figure", "row"], ["value", "1" * 100]], width)
