# Source this, from bash or zsh and any directory: a shell with the nodes, formation-gnc and the Python packages.
_root=$(cd "$(dirname "${BASH_SOURCE:-$0}")" && pwd)

if [ ! -e "$_root/install/.ready" ]; then
    echo "formation_gnc is not built yet: run 'make setup' in $_root, then source this again." >&2
    unset _root
    return 1
fi

case $- in *u*) _nounset=1; set +u ;; esac  # the scripts of ROS and colcon read unset variables
. "$_root/install/setup.${ZSH_VERSION:+z}${BASH_VERSION:+ba}sh"
# On a machine with ROS the chain ends in that ROS, and .venv holds the rest.
case ":$PATH:" in *":$_root/.venv/bin:"*) ;; *) export PATH="$_root/.venv/bin:$PATH" ;; esac
[ -z "${_nounset:-}" ] || set -u

: "${RMW_IMPLEMENTATION:=rmw_fastrtps_cpp}"
: "${ROS_AUTOMATIC_DISCOVERY_RANGE:=LOCALHOST}"  # nobody else on the network is part of the flight
: "${OMP_NUM_THREADS:=1}"  # the matrices are small: more threads cost time, and change the last bits
: "${OPENBLAS_NUM_THREADS:=1}"
export RMW_IMPLEMENTATION ROS_AUTOMATIC_DISCOVERY_RANGE OMP_NUM_THREADS OPENBLAS_NUM_THREADS

for _prefix in $(echo "$AMENT_PREFIX_PATH" | tr : ' '); do
    [ ! -e "$_prefix/share/ament_index/resource_index/rmw_typesupport/$RMW_IMPLEMENTATION" ] || _rmw=found
done
if [ -z "${_rmw:-}" ]; then
    echo "RMW_IMPLEMENTATION=$RMW_IMPLEMENTATION is not installed: unset it, or set it to rmw_fastrtps_cpp." >&2
    unset _root _nounset _prefix
    return 1
fi
unset _root _nounset _prefix _rmw
