"""Formats of trajectories by name: a new one is a file and a line here."""

from collections.abc import Callable, Sequence
from pathlib import Path

from formation_gnc.interchange.arrays import write_mat, write_netcdf
from formation_gnc.interchange.czml import write_czml
from formation_gnc.interchange.ephemeris import Ephemeris
from formation_gnc.interchange.oem import write_oem
from formation_gnc.interchange.stk import write_stk

OF_ONE: dict[str, tuple[str, Callable[[Ephemeris, Path], None]]] = {
    "oem": (".oem", write_oem),
    "stk": (".e", write_stk),
}
"""A file for each satellite: its suffix, and what writes it."""

OF_ALL: dict[str, tuple[str, Callable[[Sequence[Ephemeris], Path], None]]] = {
    "czml": (".czml", write_czml),
    "netcdf": (".nc", write_netcdf),
    "mat": (".mat", write_mat),
}
"""One file for all satellites: its suffix, and what writes it."""


def write_trajectories(satellites: Sequence[Ephemeris], kind: str, directory: Path, name: str) -> list[Path]:
    """Write the satellites of a run in a format.

    Args:
        satellites: chief and deputies.
        kind: of `OF_ONE` or `OF_ALL`.
        directory: to write to.
        name: of the run, for a file of all satellites and before that of each.

    Returns:
        The files.
    """
    if kind in OF_ALL:
        suffix, write_all = OF_ALL[kind]
        path = directory / f"{name}{suffix}"
        write_all(satellites, path)
        return [path]
    suffix, write = OF_ONE[kind]
    paths = [directory / f"{name}_{satellite.name}{suffix}" for satellite in satellites]
    for satellite, path in zip(satellites, paths, strict=True):
        write(satellite, path)
    return paths
