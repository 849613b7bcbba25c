"""Writing the assignment's files: one line a question or a case, so that changes can be read."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from labkit.authoring.compute import hidden_cases, visible_cases
from labkit.authoring.texts import read_texts
from labkit.files import atomic_write
from labkit.grading.assignment.files import FORMAT, to_plain
from labkit.grading.assignment.questions import Case, Cases, Question

VARIANTS = 8

Progress = Callable[[Iterable[int]], Iterable[int]]


def write_assignment(
    folder: Path, variants: int = VARIANTS, progress: Progress = iter
) -> list[Path]:
    """Compute the assignment and write its files.

    Parameters
    ----------
    folder : Path
        Must exist; `hidden/` is made in it.
    variants : int
        How many sets of hidden cases; students are spread over them.
    progress : callable
        Wraps the numbers of the variants, e.g. ``tqdm.tqdm``.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    LabkitError
        If a file cannot be written, or if no cases tell the mistakes apart.
    """
    title, questions = read_texts()
    visible = {question.id: visible_cases(question) for question in questions}
    files = {
        folder / "questions.json": questions_file(title, questions),
        folder / "visible.json": cases_file(visible),
    }
    for variant in progress(range(variants)):
        hidden = {one.id: hidden_cases(one, variant, visible[one.id]) for one in questions}
        files[folder / "hidden" / f"variant_{variant}.json"] = cases_file(hidden)
    (folder / "hidden").mkdir(exist_ok=True)
    for stale in set((folder / "hidden").glob("variant_*.json")) - files.keys():
        stale.unlink()
    for path, text in files.items():
        with atomic_write(path) as file:
            file.write(text)
    return list(files)


def questions_file(title: str, questions: Iterable[Question]) -> str:
    """The text of `questions.json`."""
    rows = [{**asdict(question), "answer": question.answer.value} for question in questions]
    head = f'"format": {FORMAT},\n"title": {_json(title)}'
    return f'{{\n{head},\n"questions": {_lines(rows)}\n}}\n'


def cases_file(cases: Cases) -> str:
    """The text of `visible.json`, or of one variant."""
    parts = [f"{_json(id)}: {_lines(map(_row, those))}" for id, those in cases.items()]
    return f'{{\n"format": {FORMAT},\n"cases": {{\n' + ",\n".join(parts) + "\n}\n}\n"


def _row(case: Case) -> Mapping[str, Any]:
    return {
        "id": case.id,
        "about": case.about,
        "arguments": [to_plain(value) for value in case.arguments],
        "expected": [to_plain(value) for value in case.expected],
        "tolerance": case.tolerance,
        "mistaken": {
            id: [to_plain(value) for value in answers] for id, answers in case.mistaken.items()
        },
    }


def _lines(rows: Iterable[Mapping[str, Any]]) -> str:
    return "[\n" + ",\n".join(map(_json, rows)) + "\n]"


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
