"""The built-in run: MIT Killian Court, 3,873 scans over 1.9 km, from the package rtb-data."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from labkit.extras import MissingExtraError

KILLIAN = "killian"
"""Name of the built-in run for `labkit.logs.read_log`."""


def killian_archive() -> Path:
    """Path of ``killian.g2o.zip`` in this Python environment."""
    spec = find_spec("rtbdata")
    if spec is None or not spec.submodule_search_locations:
        purpose = f'the built-in run "{KILLIAN}" (a file of that name is "./{KILLIAN}")'
        raise MissingExtraError(purpose, "rtb-data", "killian")
    return Path(spec.submodule_search_locations[0]) / "data" / "killian.g2o.zip"
