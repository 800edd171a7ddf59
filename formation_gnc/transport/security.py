"""Flights in the enclaves of a keystore: the environment of their processes, and whether this ROS can fly so."""

import os
import subprocess
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.access import LAUNCHER

SHARED = ("identity_ca.cert.pem", "permissions_ca.cert.pem")
"""Certificates that every enclave has of the authority."""

FILES = (*SHARED, "cert.pem", "key.pem", "governance.p7s", "permissions.p7s")
"""Files of an enclave, without one of which Fast DDS does not take it."""

OVERRIDE = "ROS_SECURITY_ENCLAVE_OVERRIDE"
"""Variable that puts every process into one enclave: that of an operator, who does not fly."""

PATIENCE = 60.0
"""Wall time (s) that a process has to join a domain, on a busy machine."""


def variables(keystore: Path) -> dict[str, str]:
    """Variables of ROS that put a process into its enclave of a keystore; Enforce: it does not fly without."""
    return {
        "ROS_SECURITY_KEYSTORE": str(keystore.absolute()),
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
    }


@contextmanager
def secured(keystore: Path) -> Iterator[None]:
    """Let this process, and those that it starts, join a domain in enclaves of a keystore alone."""
    before = {name: os.environ.get(name) for name in (*variables(keystore), OVERRIDE)}
    os.environ.update(variables(keystore))
    os.environ.pop(OVERRIDE, None)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def check_secured(keystore: Path, enclaves: Collection[str]) -> None:
    """Join a domain in the launcher's enclave, in a process of its own, before anything flies.

    Args:
        keystore: its folder.
        enclaves: full names of all others that will fly.

    Raises:
        ConfigurationError: an enclave is not in the keystore, or this ROS does not take it; with the reason.
    """
    for enclave in (LAUNCHER, *enclaves):
        place = keystore / "enclaves" / enclave.strip("/")
        lacking = [file for file in FILES if not (place / file).is_file()]
        if lacking:
            raise ConfigurationError(f"keystore {keystore}: enclave {enclave} lacks {', '.join(lacking)}; make it anew")
    try:
        with secured(keystore):
            trial = subprocess.run(
                [sys.executable, "-m", __name__], capture_output=True, text=True, timeout=PATIENCE, check=False
            )
    except subprocess.TimeoutExpired:
        raise ConfigurationError(f"secure flight: ROS does not join a domain within {PATIENCE:g} s") from None
    if trial.returncode:
        reason = trial.stdout or trial.stderr.strip().rpartition("\n")[2]
        raise ConfigurationError(f"secure flight: nothing flies, since this ROS cannot secure it: {reason.strip()}")


def _join() -> NoReturn:
    """Join a domain as a node in the launcher's enclave; prints the reason where that fails."""
    import rclpy
    from rclpy.context import Context

    from formation_gnc.transport.process import REJECTED_BY_ROS, leave

    try:
        context = Context()
        rclpy.init(args=["--ros-args", "--enclave", LAUNCHER], context=context)
        rclpy.create_node("trial", context=context)
    except REJECTED_BY_ROS as error:
        print(error)
        leave(2)
    leave(0)


if __name__ == "__main__":
    _join()
