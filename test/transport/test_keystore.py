"""Keystores: signed by their own authority, for their owner alone; and what a flight in one takes."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from formation_gnc.cli import main
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.access import access_by_process
from formation_gnc.transport.keystore import make_keystore
from formation_gnc.transport.security import OVERRIDE, check_secured, secured

ACCESSES = access_by_process(["deputy1"])
HAS_ROS = shutil.which("ros2") is not None  # the wheels' Fast DDS is built without security


@pytest.fixture
def keystore(tmp_path: Path) -> Path:
    make_keystore(tmp_path / "keys", ACCESSES)
    return tmp_path / "keys"


def openssl(*arguments: str | Path) -> subprocess.CompletedProcess[bytes]:
    if shutil.which("openssl") is None:
        pytest.skip("no openssl here")
    return subprocess.run(["openssl", *arguments], capture_output=True, check=False)


def test_documents_are_signed_by_the_keystores_authority(keystore: Path, tmp_path: Path) -> None:
    make_keystore(tmp_path / "other", ACCESSES)
    for document in ("governance", "plant/permissions", "deputy1/controller/permissions"):
        signed = keystore / "enclaves" / f"{document}.p7s"
        verify = ("smime", "-verify", "-text", "-in", signed, "-CAfile")
        result = openssl(*verify, keystore / "public/permissions_ca.cert.pem")
        assert result.returncode == 0, result.stderr
        assert result.stdout.replace(b"\r\n", b"\n") == signed.with_suffix(".xml").read_bytes()
        assert openssl(*verify, tmp_path / "other/public/permissions_ca.cert.pem").returncode != 0


def test_an_altered_permission_is_no_longer_signed(keystore: Path) -> None:
    signed = keystore / "enclaves/deputy1/guidance/permissions.p7s"
    signed.write_bytes(signed.read_bytes().replace(b"rt/deputy1/target", b"rt/deputy1/thrust"))
    result = openssl("smime", "-verify", "-text", "-in", signed, "-CAfile", keystore / "public/ca.cert.pem")
    assert result.returncode != 0


def test_every_enclave_is_certified_by_its_name(keystore: Path) -> None:
    for name in ACCESSES:
        certificate = keystore / "enclaves" / name.strip("/") / "cert.pem"
        assert openssl("verify", "-CAfile", keystore / "public/identity_ca.cert.pem", certificate).returncode == 0
        subject = openssl("x509", "-in", certificate, "-noout", "-subject", "-nameopt", "RFC2253").stdout
        assert subject.decode().strip() == f"subject=CN={name}"


def test_keys_are_for_their_owner_alone(keystore: Path) -> None:
    assert keystore.stat().st_mode & 0o077 == 0
    keys = [path for path in keystore.rglob("*.pem") if not path.is_symlink()]
    assert len(keys) == 2 + 2 * len(ACCESSES)
    for path in keys:
        assert path.stat().st_mode & 0o077 == 0, path


def test_an_existing_folder_is_left_alone(keystore: Path) -> None:
    before = (keystore / "private/ca.key.pem").read_bytes()
    with pytest.raises(ConfigurationError, match="exists already"):
        make_keystore(keystore, ACCESSES)
    assert (keystore / "private/ca.key.pem").read_bytes() == before


def test_a_process_in_an_enclave_enforces_it_and_is_no_operator(
    keystore: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(OVERRIDE, "/operator")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Permissive")
    monkeypatch.delenv("ROS_SECURITY_KEYSTORE", raising=False)
    with secured(keystore):
        inside = {name: value for name, value in os.environ.items() if name.startswith("ROS_SECURITY")}
    assert inside == {
        "ROS_SECURITY_KEYSTORE": str(keystore),
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
    }
    assert os.environ["ROS_SECURITY_STRATEGY"] == "Permissive"
    assert os.environ[OVERRIDE] == "/operator"
    assert "ROS_SECURITY_KEYSTORE" not in os.environ


def test_an_enclave_that_is_not_there_is_named_before_anything_flies(keystore: Path) -> None:
    with pytest.raises(ConfigurationError, match="enclave /deputy9/controller lacks identity_ca"):
        check_secured(keystore, ["/plant", "/deputy9/controller"])
    (keystore / "enclaves/deputy1/guidance/permissions.p7s").unlink()
    with pytest.raises(ConfigurationError, match="enclave /deputy1/guidance lacks permissions"):
        check_secured(keystore, ACCESSES)


def test_the_command_makes_a_keystore_of_a_scenario(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "keys"
    assert main(["keystore", "leader_follower", str(place), "--namespace", "north"]) == 0
    enclaves = {str(path.parent.relative_to(place / "enclaves")) for path in place.rglob("key.pem")}
    enclaves = {f"/{each}" for each in enclaves}
    assert enclaves == access_by_process(["deputy1"], "/north").keys()
    assert capsys.readouterr().out.startswith(f"{place}: {len(enclaves)} enclaves, valid for 365 days")
    assert main(["keystore", "leader_follower", str(place)]) == 2
    assert main(["keystore", "leader_follower", str(tmp_path / "more"), "--namespace", "a b"]) == 2
    assert not (tmp_path / "more").exists()


@pytest.mark.sil
@pytest.mark.parametrize("own", [True, False], ids=["for one flight", "keystore"])
def test_a_flight_is_secured_or_refused(
    own: bool, keystore: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "bag"
    way = ["--secure"] if own else ["--keystore", str(keystore)]
    status = main(["sil", "leader_follower", "--duration", "20", "--bag", str(bag), "--accept-lost", *way])
    errors = capfd.readouterr().err
    if HAS_ROS:
        assert status == 0
        assert "ROS_SECURITY_STRATEGY=Enforce" in errors
        return
    assert status == 2
    (line,) = errors.splitlines()
    assert line.startswith("formation-gnc: secure flight: nothing flies, since this ROS cannot secure it: ")
    assert "doesn't have the security libraries" in line
    assert not bag.exists()


def test_there_is_no_bus_to_secure_in_process(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--in-process", "--secure", "--bag", str(tmp_path / "bag")]
    assert main(["sil", "leader_follower", *flags]) == 2
    assert "no bus to secure" in capsys.readouterr().err
