"""The wall of this machine, and the small assignment, written once a session."""

import os
import sys

import pytest

from labkit.cli import main
from labkit.grading.box.inside.reading import read_program
from labkit.grading.box.outside import Wall, open_wall, why_not
from labkit.grading.classroom.handins import read_files
from labkit.grading.grade import grade_submission
from labkit.grading.sitting import HANDED_OUT
from labkit.support.errors import LabkitError
from tests.grading.small import write_assignment


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    return write_assignment(tmp_path_factory.mktemp("assignment") / "small")


@pytest.fixture(scope="session")
def read():
    """A function that reads a submission as the grader does: sources by name, what is unread."""

    def run(submission):
        files, unread = read_files(submission.files)
        program = read_program(files, ["f"], HANDED_OUT)
        return program.scripts, [*unread, *program.unread]

    return run


@pytest.fixture(scope="session")
def wall():
    try:
        return open_wall()
    except LabkitError:
        return Wall(mode="none")


@pytest.fixture(scope="session", params=["bubblewrap", "user"])
def safe_wall(request):
    """Each wall that SECURITY.md speaks of."""
    if reason := why_not(Wall(mode=request.param)):
        assert not reason.startswith("it can"), f"{request.param} has a hole: {reason}"
        pytest.skip(f"{request.param}: {reason} (install bubblewrap; run as root on Linux)")
    return Wall(mode=request.param)


@pytest.fixture(scope="session")
def graded(wall):
    """A function that grades files by an assignment."""

    def run(files, assignment, *, student="ada", seconds=3.0, behind=wall):
        timed = behind._replace(seconds=seconds)
        return grade_submission(files, timed, assignment, student)[0]

    return run


@pytest.fixture
def options(small, wall, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules["labkit.cli.main"], "FOLDER", small)
    (tmp_path / "small.cases").symlink_to(small)
    where = ["--no-isolation"] if wall.mode == "none" else []
    return ["grade", "--secret", str(tmp_path / "small"), "--seconds", "1", *where]


@pytest.fixture
def grade(options, tmp_path, monkeypatch):
    """Grade in an empty folder; afterwards files are for all again."""
    monkeypatch.chdir(tmp_path)
    before = os.umask(0o022)
    yield lambda *arguments: main([*options, *arguments])
    os.umask(before)
