"""Programs of the machine that some tests ask."""

from __future__ import annotations

import os
import shutil

import pytest


def program(package: str, *names: str) -> str:
    """Path of the first that is installed; in CI its absence is a failure, elsewhere a skip."""
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        missing = f"no {names[0]} here; on Debian and Ubuntu: `sudo apt install {package}`"
        (pytest.fail if os.environ.get("CI") else pytest.skip)(missing)
    return found
