"""The package: as colcon builds it beside ROS, with its nodes; and as a wheel (`make wheel`), without either."""

import sys
from pathlib import Path

from setuptools import find_packages, setup

NAME = "formation_gnc"
MODULES = ["navigation", "guidance", "controller", "supervisor"]  # rows of formation_gnc/flight/graph.py
NODES = ["plant", "satellite", "display", "recorder", "replay"]

# What a wheel asks for: newest versions that are tried are those of requirements.lock, oldest those given here.
REQUIREMENTS = [
    "clarabel>=0.11,<0.12",
    "control>=0.10.1,<0.11",
    "cryptography>=41",
    "dask>=2025.5",
    "distributed>=2025.5",
    "filterpy>=2,<3",
    "foxglove-sdk>=0.30,<1",
    "lz4>=4.4,<5",
    "matplotlib>=3.10,<4",
    "mcap>=1.2,<2",
    "numba>=0.61,<1",
    "numpy>=2.1,<3",
    "osqp>=1.0.4,<2",
    "plotly>=6.1,<8",
    "pyarrow>=18",
    "pymsis>=0.11,<1",
    "pyyaml>=6.0.2,<7",
    "rich>=13.9,<16",
    "rosbags>=0.11,<0.12",
    "scipy>=1.15,<2",
    "sgp4>=2.23,<3",
    "skyfield>=1.50,<2",
    "skyfield-data>=6,<8",
    "slycot>=0.6.1,<1",
    "zstandard>=0.23,<1",
]

SHARED = {
    f"{NAME}/params": ("params", "*.yaml"),
    f"{NAME}/campaigns": ("campaigns", "*.yaml"),
    f"{NAME}_msgs/msg": ("msg_defs/msg", "*.msg"),
    **{
        f"{package}/msg": (f"msg_defs/standard/{package}/msg", "*.msg")
        for package in ("builtin_interfaces", "rosgraph_msgs", "std_msgs")
    },
}
"""Folder below the wheel's `share`, by which formation_gnc/shipped.py finds it: folder here, and files."""


def files(folder: str, pattern: str) -> list[str]:
    """Files to install; a link that a build of before left of one that is gone is none."""
    return sorted(str(path) for path in Path(folder).glob(pattern) if path.exists())


def beside_ros() -> dict:
    """What colcon installs: the nodes, where `ros2 run` finds them, and the shared files of a ROS package."""
    return {
        "data_files": [
            ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
            (f"share/{NAME}", ["package.xml"]),
            ("bin", ["scripts/formation-gnc"]),  # colcon puts bin on PATH, and leaves the nodes off it
            (f"share/{NAME}/params", files("params", "*.yaml")),
            (f"share/{NAME}/campaigns", files("campaigns", "*.yaml")),
            (f"share/{NAME}/launch", files("launch", "*.py")),
        ],
        "install_requires": ["setuptools"],
        "extras_require": {"test": ["pytest"]},
        "entry_points": {
            "console_scripts": [
                *(f"{module} = {NAME}.nodes.module:main" for module in MODULES),
                *(f"{node} = {NAME}.nodes.{node}:main" for node in NODES),
                COMMAND,
            ]
        },
    }


def wheel() -> dict:
    """What a wheel holds: no nodes, and the shared files in the package itself."""
    shared = {f"{NAME}.share.{place.replace('/', '.')}": source for place, source in SHARED.items()}
    return {
        "package_dir": {package: folder for package, (folder, _) in shared.items()},
        "package_data": DATA | {package: [pattern] for package, (_, pattern) in shared.items()},
        "packages": [*PACKAGES, *shared],
        "install_requires": REQUIREMENTS,
        "extras_require": {"notebook": ["pandas>=2.2,<4"], "testing": ["hypothesis", "pytest"]},
        "entry_points": {"console_scripts": [COMMAND]},
        "long_description": Path("README.md").read_text(encoding="utf-8"),
        "long_description_content_type": "text/markdown",
    }


DATA = {NAME: ["py.typed", "analysis/web/*", "control/c/*"]}  # files of the package that are no modules
COMMAND = f"formation-gnc = {NAME}.cli:main"
PACKAGES = find_packages(include=[NAME, f"{NAME}.*"])
IS_WHEEL = bool({"bdist_wheel", "dist_info"} & set(sys.argv))  # as pip builds one; colcon asks for neither

setup(
    name=NAME,
    version="0.1.0",
    **{"packages": PACKAGES, "package_data": DATA, **(wheel() if IS_WHEEL else beside_ros())},
    python_requires=">=3.12",
    zip_safe=not IS_WHEEL,
    maintainer="formation_gnc maintainers",
    maintainer_email="maintainers@example.org",
    description="Formation-flying GNC as a lock-step ROS 2 node graph.",
    license="Apache-2.0",
    classifiers=[
        "Development Status :: 4 - Beta",
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: Python :: 3.12",
        "Programming Language :: Python :: 3.13",
        "Topic :: Scientific/Engineering",
        "Typing :: Typed",
    ],
)
