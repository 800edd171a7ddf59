#!/usr/bin/env bash
# Builds the wheel, with a Python that has setuptools, into a directory; fetches nothing.
set -euo pipefail
python=$1
mkdir -p "$2"
output=$(cd "$2" && pwd)
cd "$(dirname "$0")/.."

scratch=$(mktemp -d) # a folder of its own: what was built before must not get in
trap 'rm -rf "$scratch"' EXIT
"$python" -W ignore setup.py -q egg_info -e "$scratch" build -b "$scratch/build" bdist_wheel -d "$scratch/wheel" \
    > "$scratch/log" 2>&1 || { cat "$scratch/log" >&2; exit 1; }
rm -f "$output"/formation_gnc-*.whl
cp "$scratch"/wheel/*.whl "$output"
ls "$output"/formation_gnc-*.whl
