"""Machine code on disk: compiled once a machine, anew when its source changes or a file is damaged.

numba looks at each source file alone: a stage is not compiled anew when another file that it
calls into has changed. So all code stands in one folder of the user's cache, named by a hash of
all files that hold stages. Each kept file ends with a digest of its content, and one that is
cut or changed counts as missing. Where nothing can be kept, each process compiles for itself.
"""

from __future__ import annotations

import functools
import hashlib
import io
import logging
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
from numba.core import caching

PACKAGE = Path(__file__).parents[1]
STATES = 8  # of the source whose code is kept: several copies of the lab share a cache
log = logging.getLogger("labkit")


def keep(dispatcher: Any) -> Any:
    """The same compiled function, with its machine code kept on disk."""
    folder = cache_folder()
    if folder is None:
        return dispatcher
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
    try:
        dispatcher._cache = _FunctionCache(dispatcher.py_func)
    finally:
        numba.config.CACHE_DIR = before
    return dispatcher


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
    """A hash of all files that hold stages, and of the versions of numba and Python."""
    seen = hashlib.sha256(f"{numba.__version__} {sys.version_info[:3]}".encode())
    for path in sorted(PACKAGE.rglob("*.py")):
        source = path.read_bytes()
        if b"\n@compiled" in source:
            seen.update(source)
    return seen.hexdigest()[:16]


@functools.cache
def cache_folder() -> Path | None:
    """The folder of the machine code; None, with one line of warning, where none can be made."""
    try:
        folder = user_cache() / f"stages-{fingerprint()}"
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".{os.getpid()}"
        probe.touch()
        probe.unlink()
    except (OSError, RuntimeError) as error:  # read-only, full, or a user without a home
        log.warning("compiling the matcher in every process, 10 s or more: %s", error)
        return None
    if not any(folder.rglob("*.nbc")):
        log.warning("compiling the matcher, this once: 10 s or more")
        states = sorted(folder.parent.glob("stages-*"), key=os.path.getmtime, reverse=True)
        for outdated in states[STATES:]:
            shutil.rmtree(outdated, ignore_errors=True)
    return folder


class _FunctionCache(caching.FunctionCache):  # type: ignore[misc]
    """numba's cache of one function, whose files tell damage."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self.cache_path, self._impl.filename_base, stamp)

    def save_overload(self, signature: Any, data: Any) -> None:
        try:
            super().save_overload(signature, data)
        except OSError as error:  # a full disk
            log.warning("the compiled matcher cannot be kept: %s", error)


class _Files(caching.IndexDataCacheFile):  # type: ignore[misc]
    """numba's index and code, each with a digest at its end, which unpickling passes over."""

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue() + _digest(content.getvalue()))

    def _load_index(self) -> Any:
        return super()._load_index() if _is_whole(self._index_path) else {}

    def _load_data(self, name: str) -> Any:
        if not _is_whole(self._data_path(name)):
            raise OSError  # numba compiles anew, as where the file is missing
        return super()._load_data(name)


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


def _is_whole(path: str) -> bool:
    try:
        content = Path(path).read_bytes()
    except OSError:
        return False
    return content[-32:] == _digest(content[:-32])
