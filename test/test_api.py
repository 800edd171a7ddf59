"""The public interface: its names. The tutorial on notebooks flies by them alone."""

import ast
import inspect
from pathlib import Path

import pytest

from formation_gnc import api


def test_type_checkers_see_the_names_that_the_interpreter_gives() -> None:
    tree = ast.parse(Path(api.__file__).read_text(encoding="utf-8"))
    (checked,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {
        alias.asname: each.module for each in checked.body if isinstance(each, ast.ImportFrom) for alias in each.names
    }
    assert seen == api._MODULES


@pytest.mark.parametrize("name", api.__all__)
def test_every_public_name_is_there_and_says_what_it_is(name: str) -> None:
    assert inspect.getdoc(getattr(api, name))


def test_another_name_is_not_public() -> None:
    with pytest.raises(AttributeError, match=r"formation_gnc\.api has no numpy"):
        _ = api.numpy
