#!/usr/bin/env bash
# Makes .venv with everything that requirements.lock names: ROS 2 too, unless the machine has it. One that was
# made for the same ROS and the same place is kept, and brought up to the lock.
set -euo pipefail
cd "$(dirname "$0")/.."
read -r ros _ < .ros  # the prefix of the ROS 2 in use, or "wheels"

missing=()  # all that has to be installed, told at once

# Runs on any Python 3 and says "right <path>", or what is missing, or nothing for another version.
appraise='
import importlib.util, os, sys, sysconfig
if sys.version_info[:2] == (3, 12):
    if not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")):
        print("headers")
    elif not importlib.util.find_spec("ensurepip"):
        print("venv")
    elif "rclpy" in sys.argv and not importlib.util.find_spec("rclpy"):
        print("rclpy")
    else:
        print("right", sys._base_executable)
'

find_python() { # of these candidates, into $python; [rclpy, if it must have that]
    local candidate verdict path lacking=""
    for candidate in "${candidates[@]}"; do
        # A pyenv shim stands on PATH for inactive versions too, and fails.
        read -r verdict path < <("$candidate" -c "$appraise" "$@" 2> /dev/null) || continue
        if [[ $verdict == right ]]; then
            python=$path
            return
        fi
        lacking=${lacking:-$verdict}
    done
    case $lacking in
        headers) missing+=("Python 3.12 lacks its headers: install python3.12-dev") ;;
        venv) missing+=("Python 3.12 lacks venv: install python3.12-venv") ;;
        rclpy) missing+=("the ROS 2 Jazzy in $ros lacks rclpy: install ros-jazzy-rclpy") ;;
        *) missing+=("no Python 3.12: install python3.12, python3.12-dev and python3.12-venv, or where there are none \
(Debian 13, Ubuntu 22.04) install python3-venv, by which uv fetches one") ;;
    esac
}

fetch_python() { # with uv, which comes from PyPI where it is missing; into $python
    local uv=uv
    if ! command -v uv > /dev/null; then
        uv=build/uv/bin/uv
        python3 -c "import ensurepip, venv" 2> /dev/null || return
    fi
    echo "formation_gnc: no Python 3.12 with headers and venv here: uv fetches one, for this user"
    if [[ $uv != uv ]]; then
        rm -rf build/uv
        python3 -m venv build/uv && build/uv/bin/python -m pip install -qq --disable-pip-version-check uv || return
    fi
    "$uv" python install --quiet 3.12 && python=$(UV_PYTHON_PREFERENCE=only-managed "$uv" python find 3.12)
}

compilers="${CC:-cc} ${CXX:-c++}"
for compiler in $compilers; do
    command -v "$compiler" > /dev/null || missing+=("no C++ compiler ($compiler): install g++")
done

if [[ $ros == wheels ]]; then
    candidates=(python3.12 python3 "${PYENV_ROOT:-${HOME:-}/.pyenv}"/versions/3.12*/bin/python3.12)
    candidates+=("${UV_PYTHON_INSTALL_DIR:-${XDG_DATA_HOME:-${HOME:-}/.local/share}/uv/python}"/cpython-3.12*/bin/python3.12)
    ! command -v uv > /dev/null || candidates+=("$(uv python find 3.12 2> /dev/null || true)")
    lacked=${#missing[@]}
    find_python
    # Nothing is fetched where the set-up would end all the same.
    if ((lacked == 0 && ${#missing[@]} > 0)) && fetch_python; then
        missing=()
    fi
    options=()
    left_out='^$'
else
    if [[ :${AMENT_PREFIX_PATH:-}: != *:$ros:* ]]; then
        set +u
        source "$ros/setup.bash"
        set -u
    fi
    candidates=(/usr/bin/python3 python3 python3.12)
    find_python rclpy
    options=(--system-site-packages)
    left_out='^(ros-|catkin-pkg=|empy=|lark-parser=)'  # an installed ROS brings its own
fi

if ((${#missing[@]})); then
    printf -v all '%s; ' "${missing[@]}"
    echo "formation_gnc: ${all%; }." >&2
    exit 2
fi

if ! cmp --quiet .ros .venv/.ros; then
    echo "formation_gnc: making .venv with $python (a minute or two, once)"
    rm -rf .venv build/formation_gnc build/formation_gnc_msgs install  # what was built on the old one goes with it
    "$python" -m venv "${options[@]}" .venv
fi

install() { # awk condition on the lines of the lock that name a package
    awk '/^[^ #]/ { keep = '"$1"' } keep' requirements.lock > .venv/requirements.txt
    # The lock is complete, so there is nothing to resolve.
    .venv/bin/python -m pip install -qq --disable-pip-version-check --require-hashes --no-deps \
        --no-build-isolation --requirement .venv/requirements.txt
}
install '/^setuptools=/'  # first: it builds empy, the only one that comes as source
install "!/$left_out/"

# Either way .venv/setup.* gives the environment that both packages are built in.
if [[ $ros == wheels ]]; then
    .venv/bin/python tools/ros_prefix.py
else
    for shell in sh bash zsh; do
        cat > ".venv/setup.$shell" << END
case ":\$AMENT_PREFIX_PATH:" in *":$ros:"*) ;; *) . "$ros/setup.$shell" ;; esac
export PATH="$PWD/.venv/bin:\$PATH"
END
    done
fi
cp .ros .venv/.ros
