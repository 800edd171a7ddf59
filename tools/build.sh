#!/usr/bin/env bash
# Builds both packages with colcon into install/, on the ROS 2 that .venv was made for.
set -eo pipefail  # no -u: the scripts of ROS read unset variables
cd "$(dirname "$0")/.."

read -r ros _ < .ros
if [[ $ros == wheels ]]; then
    unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PYTHONPATH
    source .venv/setup.bash
elif [[ :${AMENT_PREFIX_PATH:-}: != *:$ros:* ]]; then
    source "$ros/setup.bash"
fi
PATH=$PWD/.venv/bin:$PATH  # CMake takes the Python that it finds first
colcon build --event-handlers desktop_notification- status-
