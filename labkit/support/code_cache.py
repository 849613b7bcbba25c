"""Compiled code on disk; recompiled when the source changes or a file is damaged.

numba looks at each source file alone, and misses a change in a file that a stage calls into. So
all code stands in one folder of the user's cache, named by a hash of all files with compiled
functions; copies of the lab share it. The variable ``LABKIT_CACHE`` names another place for that
folder.
"""

import functools
import logging
import os
import pickle
import shutil
import sys
import tempfile
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from numba.core import caching
from numba.misc import appdirs

SOURCES = Path(__file__).parents[1]
KEPT_STATES = 8  # versions of the source whose code is kept: copies of the lab share a cache
tell = functools.cache(logging.getLogger("labkit").warning)  # once


@functools.cache
def tell_of_compiling() -> None:
    """Say why a first call takes long; in a notebook as output, since stderr looks like a fault."""
    line = "compiling the matcher for this computer, once: 10 to 30 s"
    if "ipykernel" in sys.modules:
        sys.stdout.write(f"{line}\n")
    else:
        tell(line)


def keep(dispatcher: Any) -> Any:
    """Return the compiled function, whose machine code numba now keeps on disk."""
    if cache_folder() is not None:
        dispatcher._cache = _FunctionCache(dispatcher.py_func)
    return dispatcher


@functools.cache
def cache_folder() -> Path | None:
    """The folder of the machine code; None, with one line of warning, where none can be made."""
    place = Path(os.environ.get("LABKIT_CACHE") or appdirs.user_cache_dir("labkit", False))
    place = place.expanduser()
    folder = place / f"stages-{fingerprint()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):  # it can be written to, and is in use
            states = sorted(place.glob("stages-*"), key=os.path.getmtime, reverse=True)
    except OSError as error:  # read-only, full, or a user without a home
        tell("compiling the matcher in every process, 10 s or more: %s", error)
        return None
    for outdated in states[KEPT_STATES:]:
        shutil.rmtree(outdated, ignore_errors=True)
    return folder


def fingerprint() -> str:
    """A hash of all files with compiled functions, and of the versions of numba and Python."""
    sources = map(Path.read_bytes, sorted(SOURCES.rglob("*.py")))
    stages = b"".join(source for source in sources if b"\n@compiled" in source)
    versions = f"{numba.__version__} {sys.version_info[:3]}"
    return sha256(stages + versions.encode()).hexdigest()[:16]


class _Locator(caching._CacheLocator):  # type: ignore[misc]
    """Place of the code that numba keeps of a function: a folder named by the sources."""

    def __init__(self, function: Any, file: str) -> None:
        self._name = f"{Path(file).parent.name}-{function.__code__.co_firstlineno}"

    @classmethod
    def from_function(cls, function: Any, file: str) -> Any:
        return cls(function, file)

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        return ""  # the folder's name is one

    def get_disambiguator(self) -> str:
        return self._name


class _Implementation(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


class _FunctionCache(caching.FunctionCache):  # type: ignore[misc]
    """numba's cache of a function, in our folder and with our files."""

    _impl_class = _Implementation

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self.cache_path, self._impl.filename_base, stamp)


class _Files(caching.IndexDataCacheFile):  # type: ignore[misc]
    """numba's index and code of a function, each followed by its SHA-256 digest."""

    def load(self, key: Any) -> Any:
        index = Path(self._index_path)
        for file in index.parent.glob(f"{index.stem}*.nb[ic]"):
            content = file.read_bytes().removeprefix(pickle.dumps(self._version, -1))
            if content[-32:] != sha256(content[:-32]).digest():
                file.unlink(missing_ok=True)  # numba compiles anew
        code = super().load(key)
        if code is None:
            tell_of_compiling()
        return code

    def save(self, key: Any, data: Any) -> None:
        try:
            super().save(key, data)
        except OSError as error:  # a full disk
            tell("the compiled matcher cannot be kept: %s", error.strerror)

    def _dump(self, content: Any) -> Any:
        return (dumped := super()._dump(content)) + sha256(dumped).digest()
