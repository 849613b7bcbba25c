"""The assignment's files, and the secret that the hidden ones are drawn from.

`questions.json` and `visible.json` are for everybody; `hidden/` is left out of what students get.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

from labkit.course.grading.assignment.questions import (
    Answer,
    Assignment,
    Case,
    Cases,
    Misconception,
    Question,
)
from labkit.course.grading.inside.data import from_json
from labkit.support.errors import LabkitError

FOLDER = Path(__file__).parent
FORMAT = 3
COURSE = "course.json"  # in `hidden/`: right functions, the salt, whether a secret went in
WRITE = "write the assignment with `python -m labkit.course.authoring [--secret FILE]`"
LEAST = 16  # bytes of a secret


@cache
def load_assignment(folder: str | os.PathLike[str] = FOLDER, *, hidden: bool = True) -> Assignment:
    """Read an assignment from its folder; a grader wants the `hidden` cases, a notebook has none.

    Raises `LabkitError` if a file is missing or of another format.

    >>> load_assignment(hidden=False).question("huber_weights").signature
    '(residuals, delta)'
    """
    folder = Path(folder)
    digest = hashlib.sha256()
    head = _read(folder / "questions.json", digest)
    visible = _cases(_read(folder / "visible.json", digest), False)
    files = sorted((folder / "hidden").glob("variant_*.json")) if hidden else []
    if hidden and not files:
        raise LabkitError(f"{folder} holds no hidden cases: this is the students' edition; {WRITE}")
    course = folder / "hidden" / COURSE
    kept = _read(course, digest) if hidden and course.exists() else {}
    return Assignment(
        title=head["title"],
        questions=tuple(map(_question, head["questions"])),
        visible=visible,
        variants=tuple(_cases(_read(file, digest), True) for file in files),
        digest=digest.hexdigest(),
        **{name: kept[name] for name in ("right", "salt", "public") if kept},
    )


def _read(path: Path, digest: Any) -> dict[str, Any]:
    """The content of a file, which goes into the digest, too."""
    try:
        data = path.read_bytes()
        content: dict[str, Any] = json.loads(data)
        version = content.get("format") if isinstance(content, dict) else None
        if version != FORMAT:
            raise ValueError(f"it has format {version!r}, this labkit reads {FORMAT}")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", error)
        raise LabkitError(f"cannot read {path}: {why}; {WRITE}") from None
    digest.update(data)
    return content


def _question(fields: dict[str, Any]) -> Question:
    known = tuple(Misconception(**each) for each in fields["misconceptions"])
    return Question(**fields | {"answer": Answer(fields["answer"]), "misconceptions": known})


def _cases(content: dict[str, Any], hidden: bool) -> Cases:
    def values(trees: list[Any]) -> tuple[Any, ...]:
        return tuple(map(from_json, trees))

    def case(fields: dict[str, Any]) -> Case:
        fields |= {name: values(fields[name]) for name in ("arguments", "expected")}
        fields["mistaken"] = {id: values(each) for id, each in fields["mistaken"].items()}
        return Case(hidden=hidden, **fields)

    return {question: tuple(map(case, cases)) for question, cases in content["cases"].items()}


def cases_beside(path: str | os.PathLike[str]) -> Path:
    """The folder of the cases that are drawn from the secret in a file: ``course.secret.cases``."""
    return Path(f"{os.path.abspath(path)}.cases")


def refuse_outdated(drawn: Assignment, now: Assignment, secret: str | os.PathLike[str]) -> None:
    """Raise `LabkitError` where cases were drawn for other questions than there are now."""
    names = ("id", "title", "points", "signature", "docstring", "answer", "chance")
    for old, new in zip_longest(drawn.questions, now.questions):
        for name in names:
            before, after = (getattr(one, name, None) for one in (old, new))
            if before != after:
                raise LabkitError(
                    f"{cases_beside(secret)} was drawn for an older assignment: the {name} of "
                    f"`{(new or old).id}` was {before!r} and is {after!r}. Draw it again: "
                    f"`python -m labkit.course.authoring --secret {os.fspath(secret)}`"
                )


def read_secret(path: Path) -> bytes:
    """The secret in a file, which is made for its owner alone where there is none."""
    try:
        if not path.exists():
            path.touch(mode=0o600)
            path.write_text(secrets.token_hex(32) + "\n", encoding="ascii")
        secret = path.read_bytes().strip()
    except OSError as error:
        raise LabkitError(f"cannot read or write {path}: {error.strerror}") from None
    if len(secret) < LEAST:
        raise LabkitError(
            f"{path} holds {len(secret)} bytes, a secret needs {LEAST}: remove it, and "
            f"`python -m labkit.course.authoring --secret {path}` makes one"
        )
    return secret


def salt_of(secret: bytes) -> str:
    """The salt beside the cases; it chooses the variants."""
    return hashlib.sha256(b"salt" + secret).hexdigest() if secret else ""
