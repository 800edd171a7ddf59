from pathlib import Path

from setuptools import find_packages, setup

NAME = "formation_gnc"
MODULES = ["navigation", "guidance", "controller", "supervisor"]  # rows of formation_gnc/flight/graph.py
NODES = ["plant", "satellite", "display", "recorder", "replay"]


def files(folder: str, pattern: str) -> list[str]:
    """Files to install; a link that a build of before left of one that is gone is none."""
    return sorted(str(path) for path in Path(folder).glob(pattern) if path.exists())


setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["analysis/web/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        ("bin", ["scripts/formation-gnc"]),  # colcon puts bin on PATH, and leaves the nodes off it
        (f"share/{NAME}/params", files("params", "*.yaml")),
        (f"share/{NAME}/campaigns", files("campaigns", "*.yaml")),
        (f"share/{NAME}/launch", files("launch", "*.py")),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="formation_gnc maintainers",
    maintainer_email="maintainers@example.org",
    description="Formation-flying GNC as a lock-step ROS 2 node graph.",
    license="Apache-2.0",
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": [
            *(f"{module} = {NAME}.nodes.module:main" for module in MODULES),
            *(f"{node} = {NAME}.nodes.{node}:main" for node in NODES),
            f"formation-gnc = {NAME}.cli:main",
        ]
    },
)
