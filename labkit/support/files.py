"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Literal

from labkit.support.errors import WriteError


@contextmanager
def atomic_write(path: str | os.PathLike[str], mode: Literal["w", "wb"] = "w") -> Iterator[IO[Any]]:
    """Open a file for writing that takes its name only when the block ends well.

    The block writes text in UTF-8, or bytes, to a temporary file beside `path`, which replaces
    it in one step (`os.replace`). On an exception or Ctrl-C the temporary file is removed, and
    the file at `path` stays as it was. Links are followed; a device or a pipe is written to.
    """
    target = _target(path)
    try:
        refuse_unwritable(path)
        if _is_special(target):
            with _open(target, mode) as file:
                yield file
            return
        temporary = target.with_name(f".{secrets.token_hex(8)}.tmp")
        try:
            with _open(temporary, mode) as file:
                yield file
            if target.exists():
                shutil.copymode(target, temporary)
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise WriteError(
            f"cannot write {os.fspath(path)}: {error.strerror or error}; choose another place"
        ) from error


def refuse_unwritable(path: str | os.PathLike[str]) -> None:
    """Raise the `WriteError` that writing to `path` would raise, before any work is done."""
    target = _target(path)
    folder = target.parent
    if os.path.isdir(target):
        problem = "it is a directory; name a file in it"
    elif os.path.exists(target) and not os.access(target, os.W_OK):
        problem = "it is write-protected; choose another name, or lift that"
    elif _is_special(target):
        return
    elif not os.path.isdir(folder):
        problem = f"the directory {folder} does not exist; make it first"
        if not os.access(next(filter(os.path.isdir, folder.parents)), os.X_OK):
            problem = "Permission denied; choose another place"
    elif not os.access(folder, os.W_OK | os.X_OK):  # for a temporary file beside it
        problem = f"the directory {folder} may not be written in; choose another, or lift that"
    else:
        return
    raise WriteError(f"cannot write {os.fspath(path)}: {problem}")


def _target(path: str | os.PathLike[str]) -> Path:
    """The file behind links; a device or a pipe is opened by the name given."""
    return Path(path) if _is_special(path) else Path(os.path.realpath(path))


def _is_special(path: str | os.PathLike[str]) -> bool:
    """Recognise a device or a pipe: it exists, but is neither a regular file nor a directory."""
    return os.path.exists(path) and not (os.path.isfile(path) or os.path.isdir(path))


def _open(path: Path, mode: Literal["w", "wb"]) -> IO[Any]:
    if mode == "wb":
        return path.open("wb")
    return path.open("w", encoding="utf-8", newline="\n")
