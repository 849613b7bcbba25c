"""The secret of a course: what its hidden cases are drawn from, so that nobody else can.

Without one, anybody who has this repository computes the same hidden cases, and a table of
their answers earns all points.
"""

from __future__ import annotations

import hashlib
import os
import secrets
from pathlib import Path

from labkit.errors import LabkitError
from labkit.grading.assignment.files import load_assignment

LEAST = 16  # bytes


def read_secret(path: Path, *, make: bool = False) -> bytes:
    """The secret in a file; one is made there where `make` says so and there is none.

    Raises
    ------
    LabkitError
        Where the file cannot be read or written, or holds next to nothing.
    """
    if make and not path.exists():
        try:
            number = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except OSError as error:
            raise LabkitError(f"cannot write {path}: {error.strerror}") from None
        with open(number, "w", encoding="ascii") as file:
            file.write(secrets.token_hex(32) + "\n")
    try:
        secret = path.read_bytes().strip()
    except OSError as error:
        raise LabkitError(
            f"cannot read {path}: {error.strerror}; make a secret and its cases with "
            f"`python -m labkit.authoring --secret {path}`"
        ) from None
    if len(secret) < LEAST:
        raise LabkitError(f"{path} holds {len(secret)} bytes; a secret needs {LEAST} at least")
    return secret


def cases_beside(path: Path) -> Path:
    """The folder of the cases that are drawn from the secret in a file.

    >>> cases_beside(Path("course.secret")).as_posix()
    'course.secret.cases'
    """
    return path.with_name(f"{path.name}.cases")


def salt_of(secret: bytes) -> str:
    """What is stored beside the cases, and tells whether they were drawn from a secret."""
    return hashlib.sha256(b"salt" + secret).hexdigest() if secret else ""


def folder_of(path: str | os.PathLike[str]) -> Path:
    """The assignment that was drawn from the secret in a file.

    Raises
    ------
    LabkitError
        Where the secret cannot be read, or its cases are not there, or are those of another.
    """
    secret, folder = read_secret(Path(path)), cases_beside(Path(path))
    again = f"write them with `python -m labkit.authoring --secret {path}`"
    if not folder.is_dir():
        raise LabkitError(f"there is no {folder}, the cases of this secret; {again}")
    if load_assignment(folder).salt != salt_of(secret):
        raise LabkitError(f"{folder} was not drawn from {path}; {again}")
    return folder
