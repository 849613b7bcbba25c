"""Questions from the TOML files in `questions/`, and the catalogue of mistakes beside them."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labkit.authoring.misconceptions import MISTAKES
from labkit.grading.assignment.questions import Answer, Misconception, Question

FOLDER = Path(__file__).with_name("questions")


def read_texts() -> tuple[str, tuple[Question, ...]]:
    """The assignment's title and its questions, in their order."""
    head = tomllib.loads((FOLDER / "assignment.toml").read_text("utf-8"))
    tables: dict[str, dict[str, Any]] = {}
    for name in head["sections"]:
        tables |= tomllib.loads((FOLDER / f"{name}.toml").read_text("utf-8"))
    return head["title"], tuple(_question(id, table) for id, table in tables.items())


def introduction() -> str:
    """What stands above the first question, in Markdown."""
    text: str = tomllib.loads((FOLDER / "assignment.toml").read_text("utf-8"))["introduction"]
    return text.strip()


@dataclass(frozen=True, kw_only=True)
class ClosingCell:
    """A cell after the questions.

    Attributes
    ----------
    id : str
        Of the cell.
    kind : {"markdown", "code", "answer"}
        A text, given code, or a text that the student writes.
    text : str
        What stands in it.
    stretch : bool
        Whether it belongs to the stretch task, which an instructor may switch on.
    alt : str
        What the figure of a code cell shows, in words.
    """

    id: str
    kind: str
    text: str
    stretch: bool = False
    alt: str = ""


def closing(*, stretch: bool) -> list[ClosingCell]:
    """What stands after the last question: the student's functions on recorded scans."""
    rows = tomllib.loads((FOLDER / "closing.toml").read_text("utf-8"))["cells"]
    cells = (ClosingCell(**row | {"text": row["text"].strip()}) for row in rows)
    return [cell for cell in cells if stretch or not cell.stretch]


def _question(id: str, table: dict[str, Any]) -> Question:
    chapter = table["chapter"]
    return Question(
        id=id,
        title=table["title"],
        chapter=chapter,
        points=float(table["points"]),
        function=table.get("function", id),
        signature=table["signature"],
        task=table["task"].strip(),
        docstring=table["docstring"].strip() + "\n",
        answer=Answer(table["answer"]),
        unit=table.get("unit", ""),
        low=table.get("low"),
        high=table.get("high"),
        chance=table.get("chance", 0.0),
        builds_on=tuple(table.get("builds_on", ())),
        misconceptions=tuple(
            Misconception(
                id=one.id, says=one.says, chapter=one.chapter or chapter, credit=one.credit
            )
            for one in MISTAKES
            if one.question == id
        ),
    )
