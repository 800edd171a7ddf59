#!/usr/bin/env bash
# Makes .venv anew, with everything that requirements.lock names: ROS 2 itself included, unless the machine has it.
set -euo pipefail
cd "$(dirname "$0")/.."
read -r ros _ < .ros  # the prefix of the ROS in use, or "wheels"

fail() {
    echo "formation_gnc: $*" >&2
    exit 2
}

# Runs on any Python 3: "right", what is missing, or "other" for another version.
appraise='
import importlib.util, os, sys, sysconfig
if sys.version_info[:2] != (3, 12):
    print("other")
elif not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")):
    print("headers")
elif not importlib.util.find_spec("ensurepip"):
    print("venv")
elif len(sys.argv) > 1 and not importlib.util.find_spec(sys.argv[1]):
    print(sys.argv[1])
else:
    print("right")
'

find_python() { # [module it must have]
    local candidate verdict missing=""
    for candidate in python3.12 python3 /usr/bin/python3 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.12*/bin/python3.12 \
        "$(uv python find 3.12 2> /dev/null || true)"; do
        # A pyenv shim is on PATH for versions that are not active too, and then fails.
        verdict=$("$candidate" -c "$appraise" "$@" 2> /dev/null) || continue
        case $verdict in
            right) "$candidate" -c 'import sys; print(sys.executable)' && return ;;
            other) ;;
            *) missing=${missing:-$verdict} ;;
        esac
    done
    case $missing in
        headers) fail "Python 3.12 is here without its headers: install python3.12-dev." ;;
        venv) fail "Python 3.12 is here without venv: install python3.12-venv." ;;
        "") fail "no Python 3.12 found: install python3.12, python3.12-dev and python3.12-venv (or: uv python install 3.12)." ;;
        *) fail "ROS 2 at $ros is here without its Python package $missing: install ros-jazzy-$missing." ;;
    esac
}

command -v "${CXX:-c++}" > /dev/null && command -v "${CC:-cc}" > /dev/null || fail "no C++ compiler found: install g++."

if [[ $ros == wheels ]]; then
    python=$(find_python)
    options=()
    wanted='.'
else
    [[ :${AMENT_PREFIX_PATH:-}: == *:$ros:* ]] || { set +u; source "$ros/setup.bash"; set -u; }
    python=$(find_python rclpy)
    options=(--system-site-packages)
    wanted='^([^r]|r[^o]|ro[^s]|ros[^-])'
fi

echo "formation_gnc: making .venv with $python (a minute or two, once)"
rm -rf .venv build/formation_gnc build/formation_gnc_msgs install  # what was built names the old one
"$python" -m venv "${options[@]}" .venv

install() { # pattern of the names to take from the lock
    awk -v names="$1" '/^[^ #]/ { keep = $0 ~ names } keep' requirements.lock > .venv/requirements.txt
    # The lock is complete, so there is nothing to resolve.
    .venv/bin/python -m pip install -qq --disable-pip-version-check --require-hashes --no-deps \
        --no-build-isolation --requirement .venv/requirements.txt
}
install '^setuptools=='  # builds empy, which comes as source only
install "$wanted"
if [[ $ros == wheels ]]; then .venv/bin/python tools/ros_prefix.py; fi
