#!/usr/bin/env bash
# Builds both packages with colcon into install/, on the ROS 2 that .venv was made for.
set -eo pipefail  # no -u: the scripts of ROS read unset variables
cd "$(dirname "$0")/.."

if [[ -e .venv/local_setup.bash ]]; then
    # The wheels are all of the ROS environment: nothing of another one, perhaps sourced, is to be chained.
    unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PYTHONPATH
fi
source .venv/setup.bash
colcon build --event-handlers desktop_notification- status-

# Compile the Numba kernels now, and once: the nodes of the first flight would each do it, all at the same time.
source install/setup.bash
cd install
python -c '
import formation_gnc.nodes.plant
from formation_gnc.flight.graph import GRAPH
for row in GRAPH:
    row.module
'
