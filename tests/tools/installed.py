"""Programs of the machine that some tests ask."""

from __future__ import annotations

import os
import shutil

import pytest


def program(package: str, *names: str) -> str:
    """Path of the first that is installed; in CI its absence is a failure, elsewhere a skip."""
    paths = [path for path in map(shutil.which, names) if path is not None]
    if not paths:
        refuse = pytest.fail if os.environ.get("CI") else pytest.skip
        refuse(f"no {names[0]} here; on Debian and Ubuntu: `sudo apt install {package}`")
    return paths[0]
