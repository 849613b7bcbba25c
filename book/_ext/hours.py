"""Count the minutes of each chapter, and sum them into the hours of the pages.

The heads of the chapters hold the minutes; every other number is a sum of them and of the
tasks in `book/hours.toml`. `python book/_ext/hours.py` says what is out of date, with
``--write`` it mends that.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).parents[2]
HEAD = re.compile(
    r"(\*\*Time\.\*\* )(\d+)( min to read and try, )(\d+)"
    r"( min of exercises\. Core path: )(\d+)( min)"
)
EXERCISE = re.compile(r"(?ms)^(:{3,})\{exercise\}[^\n]*?(\d+) min([^\n]*)\n.*?^\1$")
HOURS = re.compile(r"\d+(?:\.5)? h\b")
ALLOWED = 5  # minutes between a head and the count, so that a new sentence is no new head


@dataclass(frozen=True)
class Minutes:
    """What a chapter takes: to read and try all of it, its exercises, and its core path."""

    reading: int
    exercises: int
    core: int


def count(markdown: str, rates: Mapping[str, float]) -> Minutes:
    """Count the minutes of a chapter's text without its solutions.

    Sections that begin with *Deeper* and exercises marked so are not on the core path.
    """
    exercises = [
        (int(minutes), "deeper" in mark) for _, minutes, mark in EXERCISE.findall(markdown)
    ]
    text = EXERCISE.sub("", markdown)
    reading = core = 0.0
    deeper_from = 7  # level of the heading under which all is deeper
    for level, section in _sections(text):
        if level <= deeper_from:
            deeper_from = level if re.search(r"^[^\n]*\n+(\([^\n]*\n+)?\*Deeper", section) else 7
        minutes = _reading(section, rates)
        reading += minutes
        core += 0.0 if deeper_from < 7 else minutes
    core += sum(minutes for minutes, deeper in exercises if not deeper)
    return Minutes(_round(reading), sum(minutes for minutes, _ in exercises), _round(core))


def chapters(root: Path) -> dict[int, Path]:
    """The chapters whose heads tell their minutes, by their numbers."""
    paths = (root / "notebooks").glob("[01][0-9]_*.ipynb")
    return {
        int(path.name[:2]): path for path in sorted(paths) if HEAD.search(path.read_text("utf-8"))
    }


def head(path: Path) -> Minutes:
    """The minutes that a chapter's head tells."""
    found = HEAD.search(path.read_text("utf-8"))
    assert found is not None
    return Minutes(*(int(found[group]) for group in (2, 4, 6)))


def new_head(path: Path, rates: Mapping[str, float]) -> str:
    """The chapter's file with a head that is counted anew where it is off."""
    text = path.read_text("utf-8")
    told, counted = head(path), count(_markdown(path), rates)
    off = [abs(a - b) for a, b in zip(vars(told).values(), vars(counted).values(), strict=True)]
    if max(off) <= ALLOWED and told.exercises == counted.exercises:
        return text
    numbers = counted.reading, counted.exercises, counted.core
    return HEAD.sub(r"\g<1>{}\g<3>{}\g<5>{}\g<7>".format(*numbers), text)


def new_pages(root: Path) -> dict[Path, str]:
    """The pages with the sums of the chapters' heads."""
    table = tomllib.loads((root / "book" / "hours.toml").read_text("utf-8"))
    parts = {number: head(path).core for number, path in chapters(root).items()}
    parts |= table["tasks"]

    def hours(names: Iterable[int | str]) -> str:
        return f"{round(sum(parts[name] for name in names) / 30) / 2:g}"

    pages = {name: root / "book" / f"{name}.md" for name in ("intro", "students", "instructors")}
    texts = {name: path.read_text("utf-8") for name, path in pages.items()}
    for number in chapters(root):
        row = rf"(?m)^(\| {number}\. \[\]\(.*\| )\d+(\smin \|)$"
        texts["intro"] = re.sub(row, rf"\g<1>{parts[number]}\g<2>", texts["intro"])
    for name, numbers in table["sums"].items():
        told = rf"about\s[\w.\s-]+?\shours(?=<!-- {name} -->)"
        said = f"about {hours(numbers)} hours"
        texts = {page: re.sub(told, said, text) for page, text in texts.items()}
    for plan, when in table["plans"].items():
        sums = [hours([each for part in when.values() for each in part])]
        sums += [hours(part) for part in when.values() if part]
        if row := re.search(rf"(?m)^\| \*\*{plan}\*\*.*$", texts["instructors"]):
            pieces = HOURS.split(row[0])
            mended = "".join(chain(*zip(pieces, [f"{each} h" for each in sums], strict=False)))
            texts["instructors"] = texts["instructors"].replace(row[0], mended + pieces[-1])
    return {pages[name]: text for name, text in texts.items()}


def _markdown(path: Path) -> str:
    cells = json.loads(path.read_text("utf-8"))["cells"]
    texts = (each for each in cells if each["cell_type"] == "markdown")
    return "\n\n".join(
        "".join(each["source"])
        for each in texts
        if "solution" not in each["metadata"].get("tags", [])
    )


def _sections(text: str) -> Iterable[tuple[int, str]]:
    for section in re.split(r"(?m)^(?=#+ )", text):
        if section.strip():
            yield len(section) - len(section.lstrip("#")), section


def _reading(text: str, rates: Mapping[str, float]) -> float:
    words = re.sub(r"(?s)\$\$.*?\$\$", " ", text)
    words = re.sub(r"(?m)^\s*(:{3,}|`{3}|:\w+:).*$", " ", words)
    count = sum(bool(re.search(r"\w", word)) for word in words.split())
    asked = text.count(":class: predict") * rates["prediction"]
    return (
        count / rates["words_a_minute"]
        + asked
        + text.count("{dropdown} Answer") * rates["question"]
    )


def _round(minutes: float) -> int:
    return 5 * round(minutes / 5)


def stale(root: Path) -> dict[Path, str]:
    """The chapters whose heads are off, and the pages whose sums are, with what they should say."""
    rates = tomllib.loads((root / "book" / "hours.toml").read_text("utf-8"))
    texts = {path: new_head(path, rates) for path in chapters(root).values()} | new_pages(root)
    return {path: text for path, text in texts.items() if text != path.read_text("utf-8")}


def main() -> None:
    """Say what is out of date, or mend it."""
    parser = argparse.ArgumentParser(description="Sum the hours of the course.")
    parser.add_argument("--write", action="store_true", help="mend what is out of date")
    args = parser.parse_args()
    while args.write and (old := stale(ROOT)):  # the sums after the heads
        for path, text in old.items():
            path.write_text(text, "utf-8")
    for number, path in chapters(ROOT).items():
        print(
            "{:2d}: {reading:3d} min, exercises {exercises:3d}, core path {core:3d}".format(
                number, **vars(head(path))
            )
        )
    if old := stale(ROOT):
        sys.exit("out of date: " + ", ".join(path.name for path in old))


if __name__ == "__main__":
    main()
