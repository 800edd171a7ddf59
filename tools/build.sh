#!/usr/bin/env bash
# Builds both packages with colcon into install/, on the ROS that .venv was made for.
set -eo pipefail
cd "$(dirname "$0")/.."

read -r ros _ < .ros
if [[ $ros == wheels ]]; then
    unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PYTHONPATH
    source .venv/setup.bash
elif [[ :${AMENT_PREFIX_PATH:-}: != *:$ros:* ]]; then
    source "$ros/setup.bash"
fi
.venv/bin/python -m colcon build --event-handlers desktop_notification- status-
