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

MOST_BYTES = 255  # of a name, on all usual file systems


@contextmanager
def atomic_write(path: str | os.PathLike[str], mode: Literal["w", "wb"] = "w") -> Iterator[IO[Any]]:
    """Open a file for writing that takes its name only when the block ends well.

    The block writes text in UTF-8, or bytes, to a temporary file beside `path`, which replaces
    it in one step (`os.replace`). On an exception or Ctrl-C the temporary file is removed, and
    the file at `path` stays as it was. Links are followed.
    """
    refuse_unwritable(path)
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{secrets.token_hex(8)}.tmp")
    text: dict[str, Any] = {} if mode == "wb" else {"encoding": "utf-8", "newline": "\n"}
    try:
        with temporary.open(mode, **text) as file:
            yield file
        if target.exists():
            shutil.copymode(target, temporary)
        os.replace(temporary, target)
    except OSError as error:
        raise WriteError(
            f"cannot write {os.fspath(path)}: {error.strerror or error}; choose another place"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def refuse_unwritable(path: str | os.PathLike[str]) -> None:
    """Raise the `WriteError` that writing to `path` would raise, before any work is done."""
    target = Path(os.path.realpath(path))
    if os.path.isdir(target):  # no error of pathlib's where one may not look
        problem = "it is a directory; name a file in it"
    elif os.path.exists(target) and not os.path.isfile(target):
        problem = "it is a device or a pipe; name a file"
    elif os.path.exists(target) and not os.access(target, os.W_OK):
        problem = "it is write-protected; choose another name, or lift that"
    elif len(os.fsencode(target.name)) > MOST_BYTES:
        problem = "its name is too long; choose a shorter one"
    elif not os.path.isdir(target.parent):
        problem = f"the directory {target.parent} does not exist; make it first"
    elif not os.access(target.parent, os.W_OK | os.X_OK):  # for a temporary file beside it
        problem = f"the directory {target.parent} may not be written in; choose another"
    else:
        return
    raise WriteError(f"cannot write {os.fspath(path)}: {problem}")
