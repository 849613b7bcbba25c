"""The assignment's files, how they are read, and the secret that the hidden ones are drawn from.

`questions.json` and `visible.json` are for everybody; `hidden/` is left out of what students
get. ``python -m labkit.course.authoring`` writes them. Without a secret of the course, anybody who
has this repository computes the same hidden cases, and a table of their answers earns all
points.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from labkit.course.grading.assignment.questions import (
    Answer,
    Assignment,
    Case,
    Cases,
    Misconception,
    Question,
)
from labkit.course.grading.contract import Value
from labkit.course.grading.inside.data import from_json
from labkit.errors import LabkitError

FOLDER = Path(__file__).parent
FORMAT = 1
COURSE = "course.json"  # in `hidden/`: right functions, the salt, whether a secret went in
LEAST = 16  # bytes


def load_assignment(folder: str | os.PathLike[str] = FOLDER, *, hidden: bool = True) -> Assignment:
    """Read an assignment.

    Parameters
    ----------
    folder : path-like
        Where its files are; labkit's own by default.
    hidden : bool
        Whether the hidden cases are wanted. A grader wants them, a notebook has none.

    Returns
    -------
    Assignment

    Raises
    ------
    LabkitError
        If a file is missing or is none of an assignment; if the hidden cases are wanted and
        this is the students' edition.

    Examples
    --------
    >>> assignment = load_assignment(hidden=False)
    >>> assignment.question("huber_weights").signature
    '(residuals, delta)'
    """
    return _load(Path(folder).resolve(), hidden)


@cache
def _load(folder: Path, hidden: bool) -> Assignment:
    head, digest = _read(folder / "questions.json"), hashlib.sha256()
    files = sorted((folder / "hidden").glob("variant_*.json")) if hidden else []
    if hidden and not files:
        raise LabkitError(
            f"{folder} holds no hidden cases: this is the students' edition; grade with the "
            f"instructor's one, or write them with `python -m labkit.course.authoring`"
        )
    visible = _cases(folder / "visible.json", False)
    course = folder / "hidden" / COURSE
    kept = _read(course) if hidden and course.exists() else {}
    read = [folder / "questions.json", folder / "visible.json", *files, *([course] if kept else [])]
    for file in read:
        digest.update(file.read_bytes())
    return Assignment(
        title=head["title"],
        questions=tuple(map(_question, head["questions"])),
        visible=visible,
        variants=tuple(_cases(file, True) for file in files),
        digest=digest.hexdigest(),
        right=kept.get("right", {}),
        salt=kept.get("salt", ""),
        public=kept.get("public", False),
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        content: dict[str, Any] = json.loads(path.read_text("utf-8"))
        version = content["format"]
    except OSError as error:
        raise LabkitError(
            f"cannot read {path}: {error.strerror}; name the folder of an assignment"
        ) from None
    except (ValueError, KeyError, TypeError):
        raise LabkitError(f"{path} is no file of an assignment; write it afresh") from None
    if version != FORMAT:
        raise LabkitError(f"{path} has format {version!r}, this labkit reads {FORMAT}")
    return content


def _question(fields: dict[str, Any]) -> Question:
    return Question(
        **{
            **fields,
            "answer": Answer(fields["answer"]),
            "builds_on": tuple(fields["builds_on"]),
            "misconceptions": tuple(Misconception(**known) for known in fields["misconceptions"]),
        }
    )


def _cases(path: Path, hidden: bool) -> Cases:
    questions: dict[str, list[dict[str, Any]]] = _read(path)["cases"]
    return {
        question: tuple(_case(fields, hidden) for fields in cases)
        for question, cases in questions.items()
    }


def _case(fields: dict[str, Any], hidden: bool) -> Case:
    return Case(
        id=fields["id"],
        hidden=hidden,
        about=fields["about"],
        arguments=tuple(map(from_plain, fields["arguments"])),
        expected=tuple(map(from_plain, fields["expected"])),
        tolerance=fields["tolerance"],
        mistaken=_Mistaken(fields["mistaken"]),
    )


class _Mistaken(Mapping[str, tuple[Value, ...]]):
    """The answers of known mistakes, built when a wrong answer is held against them."""

    def __init__(self, plain: Mapping[str, list[Any]]) -> None:
        self._plain = plain

    def __getitem__(self, id: str) -> tuple[Value, ...]:
        return tuple(map(from_plain, self._plain[id]))

    def __contains__(self, id: object) -> bool:
        return id in self._plain

    def __iter__(self) -> Iterator[str]:
        return iter(self._plain)

    def __len__(self) -> int:
        return len(self._plain)


def from_plain(plain: Any) -> Value:
    """What `to_json` was given; arrays come back read-only."""
    value: Value = from_json(plain)
    for array in _arrays(value):
        array.setflags(write=False)
    return value


def _arrays(value: Value) -> Iterator[np.ndarray[Any, Any]]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple | dict):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from _arrays(entry)


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
            f"`python -m labkit.course.authoring --secret {path}`"
        ) from None
    if len(secret) < LEAST:
        raise LabkitError(
            f"{path} holds {len(secret)} bytes; a secret needs {LEAST} at least: remove it, and "
            f"`python -m labkit.course.authoring --secret {path}` makes one"
        )
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
    again = f"write them with `python -m labkit.course.authoring --secret {path}`"
    if not folder.is_dir():
        raise LabkitError(f"there is no {folder}, the cases of this secret; {again}")
    if load_assignment(folder).salt != salt_of(secret):
        raise LabkitError(f"{folder} was not drawn from {path}; {again}")
    return folder
