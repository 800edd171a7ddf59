#!/usr/bin/env bash
# Prints which ROS 2 Jazzy this clone is to be built on: the prefix of the sourced or installed one, or "wheels".
set -euo pipefail

if [[ -n ${ROS_DISTRO:-} && $ROS_DISTRO != jazzy ]]; then
    echo "formation_gnc needs ROS 2 Jazzy, and this shell has ROS $ROS_DISTRO sourced: use a shell without it." >&2
    exit 2
fi

IFS=: read -ra sourced <<< "${AMENT_PREFIX_PATH:-}"
for prefix in "${sourced[@]}" /opt/ros/jazzy; do
    # A virtual environment with the wheels in it, sourced through env.sh, is not an installed ROS.
    if [[ -d $prefix/share/rclpy && ! -e $prefix/pyvenv.cfg ]]; then
        echo "$prefix"
        exit
    fi
done
echo wheels
