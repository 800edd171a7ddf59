import json
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.schema import schema_text, type_hash

TYPES = [
    "std_msgs/msg/Empty",
    "std_msgs/msg/Header",
    "diagnostic_msgs/msg/DiagnosticArray",  # nested twice, strings, constants
    "geometry_msgs/msg/TwistWithCovarianceStamped",  # several siblings, one type used twice
    "rcl_interfaces/msg/ParameterEvent",  # a type that two branches share
    "formation_gnc_msgs/msg/Truth",
    "formation_gnc_msgs/msg/Estimate",
    "formation_gnc_msgs/msg/Event",
]


@pytest.mark.parametrize("type_name", TYPES)
def test_the_schema_has_the_type_hash_of_ros(type_name: str) -> None:
    # RIHS01 covers every field name, type and array bound of the type and all it contains: text and hash
    # come from different files, and the hash is computed by a library that knows neither.
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_text(type_name), type_name))
    assert store.hash_rihs01(type_name) == type_hash(type_name)


def test_type_hash_is_the_one_in_the_shared_description() -> None:
    share = Path(get_package_share_directory("std_msgs"))
    described = json.loads((share / "msg" / "Header.json").read_text())
    assert {"type_name": "std_msgs/msg/Header", "hash_string": type_hash("std_msgs/msg/Header")} in described[
        "type_hashes"
    ]


def test_schema_is_laid_out_as_rosbag2_writes_it() -> None:
    # The form that rosbag2's test_local_message_definition_source.cpp prescribes.
    def raw(package: str, name: str) -> str:
        return (Path(get_package_share_directory(package)) / "msg" / f"{name}.msg").read_text()

    line = "=" * 80
    assert schema_text("formation_gnc_msgs/msg/Truth") == (
        raw("formation_gnc_msgs", "Truth")
        + f"\n{line}\nMSG: formation_gnc_msgs/SatelliteTruth\n{raw('formation_gnc_msgs', 'SatelliteTruth')}"
        + f"\n{line}\nMSG: std_msgs/Header\n{raw('std_msgs', 'Header')}"
        + f"\n{line}\nMSG: builtin_interfaces/Time\n{raw('builtin_interfaces', 'Time')}"
    )


@pytest.mark.parametrize(
    ("type_name", "words"),
    [
        ("Header", "package/msg/Type"),
        ("std_msgs/srv/Header", "package/msg/Type"),
        ("no_such_msgs/msg/Header", "no_such_msgs"),
        ("std_msgs/msg/NoSuch", "NoSuch.msg"),
    ],
)
def test_a_type_that_is_not_installed_is_named(type_name: str, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        schema_text(type_name)
