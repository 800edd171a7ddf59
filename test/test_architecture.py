"""The wings of the package, its independence of ROS, and how large a file, a function or a test's name may be."""

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tools.architecture import FOUNDATION, PACKAGE, ROOT, WINGS, Import, imports, modules, place, wing

BELOW: dict[str, set[str]] = {
    FOUNDATION: set(),
    "physics": {FOUNDATION},
    "flight": {FOUNDATION, "physics"},
    "data": {FOUNDATION, "physics", "flight"},
    "simulation": {FOUNDATION, "physics", "flight", "data"},
    "shell": {FOUNDATION, *WINGS},
}
"""Wings that each wing may import, besides itself."""

ROS = re.compile(
    r"(rclpy|rpyutils|ament_\w+|rosidl_\w+|launch\w*|tf2_\w+|domain_coordinator|\w+_(msgs|srvs|interfaces))(\.|$)"
)
"""Modules that come with ROS."""

EXCEPTIONS = {
    ("formation_gnc.common", "formation_gnc.orbit.constants"): "the Earth's MU, for the chief's mean motion",
    ("formation_gnc.common", "formation_gnc.orbit.elements"): "the chief's orbit, as elements",
}
"""Imports, as (module, imported), that the rules forbid, each with its reason."""

MOST_LINES = 350
LONG_FILES: dict[str, str] = {}
"""Files of the package with more lines, each with its reason."""

MOST_FUNCTION_LINES = 60
LONG_FUNCTIONS: dict[str, str] = {}
"""Functions of the package with more lines, as `file: function`, each with its reason."""

LONGEST_TEST_NAME = 70
LONG_TEST_NAMES = {  # being renamed
    "test_a_deputy_without_a_finite_answer_coasts_for_the_tick_and_gets_a_fix",
    "test_a_force_acts_along_the_hill_axes_of_the_start_of_its_tick_on_the_deputy_alone",
    "test_the_same_seed_gives_the_same_bits_and_another_seed_only_other_noise",
    "test_without_thrust_mass_does_not_matter_and_with_it_acceleration_is_force_over_mass",
}
"""Tests with a longer name."""


def forbidden(found: Iterable[Import]) -> list[str]:
    """Imports without an exception, one readable line each."""
    return [
        f"{modules()[each.module].relative_to(ROOT)}:{each.line} imports {each.target}"
        for each in found
        if (each.module, each.target) not in EXCEPTIONS
    ]


def inside() -> Iterator[Import]:
    """Imports of the package's own modules."""
    return (each for each in imports() if each.target.split(".")[0] == PACKAGE)


def functions(file: Path) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Functions and methods of a file, inner ones included."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def test_every_folder_of_the_package_belongs_to_one_wing():
    folders = {path.name for path in (ROOT / PACKAGE).iterdir() if (path / "__init__.py").exists()}
    listed = [name for names in WINGS.values() for name in names]
    assert folders <= set(listed)
    assert len(listed) == len(set(listed))


def test_wings_import_only_what_is_below_them():
    assert (
        forbidden(each for each in inside() if wing(each.target) not in {wing(each.module), *BELOW[wing(each.module)]})
        == []
    )


def test_nobody_imports_nodes():
    assert forbidden(each for each in inside() if place(each.target) == "nodes" != place(each.module)) == []


@pytest.mark.thorough
def test_flight_algorithms_do_not_import_the_plant():
    algorithms = {"navigation", "guidance", "control", "supervision"}
    assert (
        forbidden(each for each in inside() if place(each.module) in algorithms and place(each.target) == "plant") == []
    )


@pytest.mark.thorough
def test_the_core_imports_without_ros():
    core = (each for each in imports() if wing(each.module) != "shell" and not each.deferred)
    assert forbidden(each for each in core if ROS.match(each.target)) == []


def test_no_module_imports_itself_through_others():
    graph: dict[str, set[str]] = {}
    for each in inside():
        if not each.deferred and (each.module, each.target) not in EXCEPTIONS:
            graph.setdefault(each.module, set()).add(each.target)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


@pytest.mark.thorough
def test_every_exception_is_still_needed():
    there = {(each.module, each.target) for each in imports()}
    assert EXCEPTIONS.keys() <= there
    assert LONG_FILES.keys() <= long_files().keys()
    assert LONG_FUNCTIONS.keys() <= long_functions().keys()


@cache
def long_files() -> dict[str, int]:
    """Files of the package over the limit, with their numbers of lines."""
    lines = {
        str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines()) for path in modules().values()
    }
    return {file: number for file, number in lines.items() if number > MOST_LINES}


@cache
def long_functions() -> dict[str, int]:
    """Functions of the package over the limit, with their numbers of lines from `def` to the end."""
    lines = {
        f"{path.relative_to(ROOT)}: {function.name}": function.end_lineno - function.lineno + 1
        for path in modules().values()
        for function in functions(path)
    }
    return {name: number for name, number in lines.items() if number > MOST_FUNCTION_LINES}


def test_no_file_is_longer_than_350_lines():
    assert {file: number for file, number in long_files().items() if file not in LONG_FILES} == {}


@pytest.mark.thorough
def test_executables_are_read_in_one_look():
    lines = {
        name: len(path.read_text(encoding="utf-8").splitlines())
        for name, path in modules().items()
        if path.parent.name == "nodes"
    }
    assert len(lines) > 5
    assert max(lines.values()) <= 60, lines


def test_no_function_is_longer_than_60_lines():
    assert {name: number for name, number in long_functions().items() if name not in LONG_FUNCTIONS} == {}


@pytest.mark.thorough
def test_names_of_tests_have_70_characters_at_most():
    names = [
        f"{path.relative_to(ROOT)}: {function.name}"
        for path in sorted((ROOT / "test").rglob("test_*.py"))
        for function in functions(path)
        if function.name.startswith("test_") and len(function.name) > LONGEST_TEST_NAME
        if function.name not in LONG_TEST_NAMES
    ]
    assert names == []
