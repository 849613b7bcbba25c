"""The minutes in the chapters' heads are counted, and the hours on the pages are their sums.

A minute is 130 words; a prediction and a question take two, an exercise what its title says.
Sections that begin with *Deeper*, and exercises marked so, are not on the core path.
"""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEAD = re.compile(
    r"\*\*Time\.\*\* (\d+) min to read and try, (\d+) min of exercises\. Core path: (\d+) min"
)
EXERCISE = re.compile(r"(?ms)^(:{3,})\{exercise\}[^\n]*?(\d+) min([^\n]*)\n.*?^\1$")
TASKS = {"assignment": 360, "problems 1 to 5": 125, "report": 180}  # minutes
SUMS = {"core": range(1, 9), "graded": [*range(1, 9), 10, *TASKS]}


def text_of(path):
    """The Markdown of a chapter, without its solutions."""
    cells = json.loads(path.read_text("utf-8"))["cells"]
    words = [cell for cell in cells if cell["cell_type"] == "markdown"]
    told = (cell for cell in words if "solution" not in cell["metadata"].get("tags", []))
    return "\n\n".join("".join(cell["source"]) for cell in told)


TEXTS = {int(path.name[:2]): text_of(path) for path in (ROOT / "notebooks").glob("[01]*.ipynb")}
HEADS = {
    k: tuple(map(int, found.groups())) for k in sorted(TEXTS) if (found := HEAD.search(TEXTS[k]))
}


def reading(text, speed=130):
    plain = re.sub(r"(?ms)\$\$.*?\$\$|^\s*(?::{3,}|`{3}|:\w+:)[^\n]*$", " ", text)
    words = sum(bool(re.search(r"\w", word)) for word in plain.split())
    return words / speed + 2 * (text.count(":class: predict") + text.count("{dropdown} Answer"))


def counted(text):
    """Minutes to read and try, of exercises, and of the core path."""
    exercises = [(int(minutes), "deeper" in mark) for _, minutes, mark in EXERCISE.findall(text)]
    core = bare = EXERCISE.sub("", text)
    for depth in (2, 3, 4):  # a section ends at a heading that is as high
        section = rf"(?ms)^#{{{depth}}} [^\n]*\n+(?:\([^\n]*\n+)?\*Deeper.*?(?=^#{{1,{depth}}} |\Z)"
        core = re.sub(section, "", core)
    every, deeper = (sum(each[0] for each in exercises if each[1] >= k) for k in (False, True))
    return reading(bare), every, reading(core) + every - deeper


@pytest.mark.parametrize("chapter", HEADS)
def test_a_chapter_s_head_tells_the_minutes_that_are_counted(chapter):
    read, exercises, core = counted(TEXTS[chapter])
    told = HEADS[chapter]
    assert told[1] == exercises
    assert max(abs(told[0] - read), abs(told[2] - core)) < 8, f"counted {read:.0f}, {core:.0f} min"


def test_the_pages_tell_the_heads_and_their_sums():
    names = ("intro", "students", "instructors")
    intro, *others = ((ROOT / f"book/{name}.md").read_text("utf-8") for name in names)
    rows = re.findall(r"(?m)^\| (\d+)\. \[.*?\]\(.*\| (\d+)\smin \|$", intro)
    cores = {chapter: core for chapter, (_, _, core) in HEADS.items()}
    assert {int(chapter): int(core) for chapter, core in rows} == cores
    for name, parts in SUMS.items():
        hours = round(sum((TASKS | cores)[part] for part in parts) / 30) / 2
        told = re.findall(rf"about\s([\d.]+)\shours<!-- {name} -->", " ".join([intro, *others]))
        assert set(told) == {f"{hours:g}"}
    for plan in re.findall(r"(?m)^\| \*\*.*h\).*$", others[-1]):
        total, *parts = map(float, re.findall(r"\(([\d.]+) h\)", plan))
        assert abs(total - sum(parts)) <= 0.5
