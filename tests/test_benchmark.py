"""The bench runs, and the book's page on it says what its results say.

Only labkit and the lesson's listing take part here: the peers live in an environment of
their own, and how fast they are is no matter of right or wrong. Slow, for the bench is started
many times; buys that the page's figures are those of a program that runs.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.nightly]
ROOT = Path(__file__).parents[1]
BENCH, BOOK = ROOT / "tests" / "bench", ROOT / "book"
NIGHTLY = ROOT / ".github/workflows/nightly.yml"


def python(*arguments):
    return subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A run of two pairs, with the options of every night, as JSON, and what it printed."""
    (nightly,) = re.findall('BENCH_OPTIONS="(.*)"', NIGHTLY.read_text())
    file = tmp_path_factory.mktemp("bench") / "results.json"
    parts = ("--sets", "rays-180", "--no-basin")
    names = ("--matchers", "labkit", "lesson")
    done = python(
        BENCH / "run.py", *nightly.split(), "--quick", "--pairs", 2, *parts, *names, "--out", file
    )
    assert done.returncode == 0, done.stderr
    return file, done.stdout


def test_the_bench_runs_and_its_errors_are_small(results):
    file, printed = results
    assert "ray-cast rooms, 180 beams: 2 pairs, gate 0.5 m" in printed
    scores = json.loads(file.read_text())["sets"]["rays-180"]["matchers"]
    assert scores.keys() == {
        "labkit point-to-line",
        "labkit point-to-point",
        "the lesson's listing",
    }
    for score in scores.values():
        assert (score["failures"], score["unanswered"]) == (0, 0)
        assert 0.0 < score["translation_mm"]["median"] < 50.0
        assert 0.0 < score["time_ms"]["median"] <= score["time_ms"]["p95"]


def test_the_book_shows_the_results_as_they_were_written(tmp_path):
    """Nobody has touched up a number: page and figures come from the JSON beside them."""
    (tmp_path / "_static").mkdir()
    done = python(BENCH / "report.py", BOOK / "_static/benchmark.json", "--book", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "benchmark.md").read_text() == (BOOK / "benchmark.md").read_text()
    for name in ("benchmark-error.svg",):
        drawn, shown = (folder / "_static" / name for folder in (tmp_path, BOOK))
        assert drawn.read_text().count("<path") == shown.read_text().count("<path")
