"""The wall of this machine, and the small assignment, written once a session."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from small import write_assignment

from labkit.course.grading.box import Wall, open_wall
from labkit.course.grading.grade import grade_submission
from labkit.course.grading.reading import read_program
from labkit.support.errors import LabkitError


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    return write_assignment(tmp_path_factory.mktemp("assignment") / "small")


@pytest.fixture(scope="session")
def wall():
    try:
        return open_wall([])
    except LabkitError:
        return Wall(mode="none")


@pytest.fixture(scope="session")
def safe_wall(wall):
    if wall.mode == "none":
        pytest.skip("no isolation works here: install bubblewrap, or run as root on Linux")
    return wall


@pytest.fixture(scope="session")
def graded(wall):
    """A function that grades files by an assignment."""

    def run(files, assignment, *, student="ada", seconds=3.0, **more):
        timed = wall._replace(seconds=seconds)
        program = read_program(files, [one.function for one in assignment.questions])
        return grade_submission(program, timed, assignment, student, **more)

    return run
