"""The built-in run: MIT Killian Court, 3,873 scans over 1.9 km, from the package rtb-data."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from labkit.errors import LogError
from labkit.extras import MissingExtraError

KILLIAN = "killian"
"""Name of the built-in run for `labkit.logs.read_log`."""


def killian_archive() -> Path:
    """Path of ``killian.g2o.zip`` in this Python environment.

    Raises
    ------
    MissingExtraError
        If the package rtb-data is not installed.
    LogError
        If it came without the file.
    """
    spec = find_spec("rtbdata")
    folders = [] if spec is None else list(spec.submodule_search_locations or [])
    for folder in folders:
        archive = Path(folder) / "data" / "killian.g2o.zip"
        if archive.is_file():
            return archive
    purpose = f'the built-in run "{KILLIAN}" (a file of that name is "./{KILLIAN}")'
    if spec is None:
        raise MissingExtraError(purpose, "rtb-data", "killian")
    raise LogError(
        f"{purpose} needs data/killian.g2o.zip of rtb-data, which came without it; install it anew"
    )
