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
    ("formation_gnc.recording.schema", "ament_index_python.packages"): "becomes an import where it is used",
}
"""Imports, as (module, imported), that the rules forbid, each with its reason."""

MOST_LINES = 350
LONG_FILES: dict[str, str] = {
    "formation_gnc/control/mpc.py": "is being split",
    "formation_gnc/guidance/guidance.py": "is being split",
    "formation_gnc/recording/writer.py": "is being split",
}
"""Files of the package with more lines, each with its reason."""

MOST_FUNCTION_LINES = 60
LONG_FUNCTIONS: dict[str, str] = {
    "formation_gnc/recording/layout.py: foxglove_layout": "is being split",
    "formation_gnc/sil/replay.py: _fly_tick": "is being split",
    "formation_gnc/transport/launcher.py: fly_graph": "is being split",
}
"""Functions of the package with more lines, as `file: function`, each with its reason."""

LONGEST_TEST_NAME = 70
LONG_TEST_NAMES = {  # being renamed
    "test_a_browser_shows_the_page_without_errors_and_its_slider_moves_every_deputy",
    "test_a_change_of_parameters_goes_on_and_a_final_time_that_is_past_is_named",
    "test_a_chunk_with_a_wrong_checksum_alone_is_saved_and_said_to_be_unverified",
    "test_a_deputy_without_a_finite_answer_coasts_for_the_tick_and_gets_a_fix",
    "test_a_deputy_without_an_estimate_misses_its_ticks_and_comes_back_with_a_fix",
    "test_a_fleet_flies_the_same_bits_on_the_graph_composed_in_process_and_again",
    "test_a_fleet_in_flight_is_told_of_another_formation_and_changes_at_one_tick",
    "test_a_fleet_that_is_told_one_after_the_other_changes_at_one_tick_to_places_of_one_mind",
    "test_a_force_acts_along_the_hill_axes_of_the_start_of_its_tick_on_the_deputy_alone",
    "test_a_full_disk_is_one_clear_error_and_what_was_written_stays_readable",
    "test_a_new_run_drops_what_was_adopted_where_its_schedule_does_not_go_with_that",
    "test_a_node_killed_and_started_again_rejoins_and_the_log_shows_the_gap_and_replays",
    "test_a_node_started_again_flies_with_what_it_was_started_with_then_if_the_bag_has_it",
    "test_a_place_that_another_holds_is_rejected_in_flight_and_the_target_stays",
    "test_a_recorder_that_got_no_processor_hears_what_is_waiting_before_it_stops",
    "test_a_relative_orbit_closes_but_for_a_drift_of_three_pi_times_the_radial_offset",
    "test_a_relative_orbit_projects_to_a_circle_as_seen_from_the_earth_when_its_slope_is_two",
    "test_a_satellite_without_an_estimate_costs_its_fleet_a_tick_as_on_the_graph",
    "test_a_schedule_set_in_flight_is_designed_once_and_flown_in_every_new_run",
    "test_a_schedule_that_comes_too_late_is_rejected_at_its_tick_and_the_old_one_stays",
    "test_a_scheduled_change_that_is_not_allowed_is_rejected_before_the_flight",
    "test_a_scheduled_change_that_no_longer_fits_is_rejected_at_its_tick_and_the_flight_goes_on",
    "test_a_short_way_across_takes_twice_the_root_of_distance_over_acceleration",
    "test_a_written_scenario_gives_every_node_all_its_parameters_through_ros",
    "test_about_an_eccentric_chief_the_radial_motion_is_a_sine_of_the_anomaly",
    "test_all_guidances_of_a_fleet_find_the_same_places_and_the_phase_where_they_are",
    "test_an_entry_of_the_schedule_that_makes_no_sense_is_rejected_with_an_example",
    "test_bounded_start_changes_the_along_track_rate_alone_and_does_not_drift",
    "test_cross_track_extension_is_schweighart_and_sedwicks_where_theirs_is_defined",
    "test_eclipses_are_looked_for_again_soon_after_a_bad_chief_and_kept_until_then",
    "test_equidistant_satellites_keep_their_distances_which_are_those_of_a_polygon",
    "test_every_deputy_has_its_ball_name_and_trail_and_who_has_a_target_that_too",
    "test_every_nonlinear_law_flies_on_estimates_and_the_runner_agrees_bit_for_bit",
    "test_forces_along_the_hill_axes_move_as_the_accelerations_that_they_are",
    "test_identical_bags_have_no_differences_whatever_order_processes_answered_in",
    "test_in_the_suns_plane_the_night_is_as_long_as_a_cylinder_of_shadow_says",
    "test_interrupt_stops_everything_within_three_seconds_and_closes_the_bag",
    "test_nodes_started_again_in_flight_with_other_parameters_are_so_in_the_replay",
    "test_numbers_that_stand_for_something_stand_for_the_same_in_records_and_messages",
    "test_one_transform_after_the_other_leads_to_the_deputys_inertial_position",
    "test_one_under_way_begins_now_and_one_that_outlasts_the_time_ends_with_it",
    "test_over_the_last_orbit_the_filter_errs_by_less_than_three_of_its_own_sigma",
    "test_places_are_shared_out_again_when_the_schedule_changes_the_formation",
    "test_provenance_and_attachments_come_back_with_what_was_added_at_the_end",
    "test_relative_velocity_is_the_derivative_of_relative_position_on_keplerian_orbits",
    "test_scheduled_changes_are_designed_before_the_flight_and_not_again_in_it",
    "test_the_costate_becomes_that_of_the_optimum_under_a_constant_acceleration",
    "test_the_same_seed_gives_the_same_bits_and_another_seed_only_other_noise",
    "test_the_step_is_of_its_order_and_its_sensitivities_are_its_derivatives",
    "test_the_two_circular_orbits_lie_in_the_two_planes_that_hills_equations_allow",
    "test_transformation_is_smooth_through_the_circular_and_equatorial_orbit",
    "test_two_rounds_of_laws_under_load_miss_no_tick_and_step_no_further_than_the_bound",
    "test_two_scheduled_changes_of_which_the_second_comes_too_soon_are_rejected_before_the_flight",
    "test_under_a_constant_disturbance_it_settles_near_where_the_optimum_does",
    "test_what_is_prepared_has_no_effect_and_what_is_adopted_has_it_at_the_next_tick",
    "test_whatever_ticks_are_flown_the_latest_due_entry_of_the_schedule_holds",
    "test_where_places_are_shared_out_the_others_are_predicted_on_their_targets_and_else_to_coast",
    "test_wires_hand_on_in_the_order_of_speech_and_to_the_last_listener_first",
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


def test_flight_algorithms_do_not_import_the_plant():
    algorithms = {"navigation", "guidance", "control", "supervision"}
    assert (
        forbidden(each for each in inside() if place(each.module) in algorithms and place(each.target) == "plant") == []
    )


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


def test_no_function_is_longer_than_60_lines():
    assert {name: number for name, number in long_functions().items() if name not in LONG_FUNCTIONS} == {}


def test_names_of_tests_have_70_characters_at_most():
    names = [
        f"{path.relative_to(ROOT)}: {function.name}"
        for path in sorted((ROOT / "test").rglob("test_*.py"))
        for function in functions(path)
        if function.name.startswith("test_") and len(function.name) > LONGEST_TEST_NAME
        if function.name not in LONG_TEST_NAMES
    ]
    assert names == []
