import json
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory

from formation_gnc import records
from formation_gnc.errors import ConfigurationError
from formation_gnc.messages.conversion import type_name
from formation_gnc.messages.definitions import schema_text, type_hash

ROOT = Path(__file__).resolve().parents[2]
MIRRORED = [each for each in vars(records).values() if isinstance(each, type) and hasattr(each, "message")]

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


def described_hash(type_name: str) -> str:
    """Hash by the description that ROS installs with the type."""
    package, _, name = type_name.split("/")
    share = Path(get_package_share_directory(package))
    hashes = json.loads((share / "msg" / f"{name}.json").read_text())["type_hashes"]
    return next(each["hash_string"] for each in hashes if each["type_name"] == type_name)


@pytest.mark.parametrize("type_name", TYPES)
def test_the_schema_has_the_type_hash_of_ros(type_name: str) -> None:
    # RIHS01 covers every field name, type and array bound of the type and all it contains.
    assert type_hash(type_name) == described_hash(type_name)


STANDARD = sorted((ROOT / "msg_defs/standard").glob("*/msg/*.msg"))


@pytest.mark.parametrize("path", STANDARD, ids=lambda path: path.stem)
def test_standard_definitions_are_those_that_ros_installs(path: Path) -> None:
    package = path.parts[-3]
    assert (Path(get_package_share_directory(package)) / "msg" / path.name).read_bytes() == path.read_bytes()


@pytest.mark.parametrize("record", MIRRORED, ids=lambda record: record.__name__)
def test_definitions_of_all_records_are_shipped(record: type, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    assert schema_text(type_name(record))


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
