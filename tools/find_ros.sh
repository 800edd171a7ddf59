#!/usr/bin/env bash
# Prints the prefix of the ROS 2 Jazzy that is sourced or installed, or "wheels" where there is none.
set -euo pipefail

if [[ $PWD == *[[:space:]]* ]]; then
    echo "formation_gnc: '$PWD' has a space in it, which the first line of a Python script cannot name: move it." >&2
    exit 2
fi

if [[ ${ROS_DISTRO:-jazzy} != jazzy ]]; then
    echo "formation_gnc: needs ROS 2 Jazzy, but this shell has ROS $ROS_DISTRO sourced: use a shell without it." >&2
    exit 2
fi

IFS=: read -ra prefixes <<< "${AMENT_PREFIX_PATH:-}"
for prefix in "${prefixes[@]}" /opt/ros/jazzy; do
    # A virtual environment that holds the wheels, sourced through its env.sh, is not an installed ROS.
    if [[ -d $prefix/share/rclpy && ! -e $prefix/pyvenv.cfg ]]; then
        echo "$prefix"
        exit
    fi
done
echo wheels
