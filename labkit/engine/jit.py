"""How the engine is compiled: once a machine, kept on disk, anew when its source changes.

numba keeps what it compiled beside the source, and looks at each file alone: a function is
not compiled anew when another file that it calls into has changed. So the engine keeps its
own folder in the user's cache, named by a hash of all its files. That works where the
package's folder is read-only, too. Where no folder can be written to, each process compiles
for itself.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])

FOLDER = Path(__file__).parent
CONSTANTS = ("approach.py", "arrays.py", "correspondences.py", "line_alignment.py", "normals.py")
KEPT = 8  # states of the source whose code is kept: several copies of the lab share a cache


def user_cache() -> Path:
    """The folder that this system has for what can be made again; LABKIT_CACHE names another."""
    if os.environ.get("LABKIT_CACHE"):  # set to nothing is not set: that would be this folder
        return Path(os.environ["LABKIT_CACHE"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", "~/AppData/Local")).expanduser() / "labkit"
    if sys.platform == "darwin":
        return Path("~/Library/Caches/labkit").expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "labkit"


def fingerprint() -> str:
    """A hash of all source that is compiled, and of numba's and Python's versions."""
    seen = hashlib.sha256(f"{numba.__version__} {sys.version_info[:3]}".encode())
    for path in sorted([*FOLDER.glob("*.py"), *map(FOLDER.parent.joinpath, CONSTANTS)]):
        seen.update(path.read_bytes())
    return seen.hexdigest()[:16]


def cache_folder() -> Path | None:
    """Where compiled code is kept; None where nothing can be."""
    try:
        folder = user_cache() / f"engine-{fingerprint()}"
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".{os.getpid()}"
        probe.touch()
        probe.unlink()
    except (OSError, RuntimeError):  # read-only, full, or a user without a home
        return None
    return folder


def remove_outdated(folder: Path) -> None:
    """Delete the code of all but the latest states of the source."""
    others = sorted(folder.parent.glob("engine-*"), key=os.path.getmtime, reverse=True)
    for outdated in others[KEPT:]:
        shutil.rmtree(outdated, ignore_errors=True)


CACHE = cache_folder()
_njit: Any = numba.njit  # its wrappers' options are not in its types
_config: Any = numba.config
_PART = {"nogil": True, "error_model": "numpy"}
_INNER = {**_PART, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def compiled(function: F) -> F:
    """Compile `function` as a part of what calls it: no Python objects inside."""
    made: F = _njit(**_INNER)(function)
    return made


def inlined(function: F) -> F:
    """The same for a small function in a hot loop: it is put where it is called."""
    made: F = _njit(**_INNER, forceinline=True)(function)
    return made


def entry(function: F) -> F:
    """Compile `function` when Python first calls it, and keep it on disk.

    It runs without the interpreter's lock, so that threads share the cores.
    """
    before = _config.CACHE_DIR
    _config.CACHE_DIR = "" if CACHE is None else str(CACHE)
    try:
        made: F = _njit(**_PART, cache=CACHE is not None)(function)
    finally:
        _config.CACHE_DIR = before
    return made


def announce() -> None:
    """Say what the first call waits for, where nothing was compiled before."""
    if CACHE is not None and any(CACHE.rglob("*.nbc")):
        return
    times = "in every process, for the cache cannot be written" if CACHE is None else "this once"
    logging.getLogger("labkit").warning("compiling the ICP engine, %s: 10 to 30 s", times)
    if CACHE is not None:
        remove_outdated(CACHE)
