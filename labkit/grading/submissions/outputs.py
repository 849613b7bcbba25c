"""What the grader itself left among the submissions: no student's work."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

from labkit.grading.submissions.files import may_hold_source, printable

VERDICTS = "verdicts.jsonl"  # the file by which a folder of verdicts and pages is known
PAGES = "students/"  # a folder in it


def folder_below(path: Path, folder: str | os.PathLike[str]) -> str:
    """A folder's name below `path`, with its "/"; empty where it is that, or lies elsewhere."""
    try:
        below = Path(folder).resolve().relative_to(path.resolve())
    except ValueError:
        return ""
    return f"{printable(below.as_posix())}/" if below.parts else ""


def earlier_outputs(names: Collection[str]) -> list[str]:
    """Folders of earlier verdicts and pages, each with its "/", in which nobody's work lies.

    >>> earlier_outputs(["ada/a.py", "grades/verdicts.jsonl", "grades/students/ada.html"])
    ['grades/']
    >>> earlier_outputs(["ada/a.py", "ada/verdicts.jsonl"])
    []
    """
    holders = [name.removesuffix(VERDICTS) for name in names if Path(name).name == VERDICTS]
    sources = [name for name in names if may_hold_source(name)]
    folders = [holder or PAGES for holder in holders]
    return [folder for folder in folders if not any(one.startswith(folder) for one in sources)]
