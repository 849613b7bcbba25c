"""The law of the students' edition: no file that git does not track is in it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
import students_edition as edition
from handed_out import HANDED_OUT, EditionError, choose_files

from tests.tools.installed import program

PRIVATE = (
    "course.secret",
    "course.secret.cases/variant_1.json",
    "grades/scores.csv",
    "gradebook.csv",
    "submissions/ada.ipynb",
    "hand-ins.zip",
    "2026-11-27_Grades-ICP.csv",
)
DRAFTS = ("my_own_solution.py", "exam.md", ".env", "Lösung 2.ipynb")


def git(root: Path, *command: str) -> None:
    subprocess.run([program("git", "git"), "-C", root, *command], check=True, capture_output=True)


def plant(root: Path, name: str) -> str:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("{}", "utf-8")
    return name


@pytest.fixture
def checkout(tmp_path):
    """A small course in git."""
    root = tmp_path / "course"
    for name in ("pyproject.toml", "notebooks/01.ipynb", "labkit/icp.py", "book/students.md"):
        plant(root, name)
    git(root, "init")
    git(root, "add", "--all")
    return root


@pytest.mark.parametrize("folder", ["notebooks", "book", "labkit/course", "tests/conformance"])
def test_a_file_that_git_does_not_track_is_named_and_not_handed_out(checkout, folder):
    planted = [plant(checkout, f"{folder}/{name}") for name in DRAFTS]

    files, untracked = choose_files(checkout)

    assert len(files) == 4
    assert untracked == sorted(planted)


def test_every_file_of_the_edition_is_tracked_or_written_by_it(course, tmp_path):
    # Not in the edition of other tests: they run programs there, whose bytecode Python keeps.
    lab = tmp_path / "edition" / "lab"
    edition.write_edition(course, lab.parent, with_book=False)
    tracked = subprocess.check_output(["git", "-C", course, "ls-files"], text=True).split("\n")

    files = {path.relative_to(lab).as_posix() for path in lab.rglob("*") if path.is_file()}

    assert files - set(tracked) == {"README.md"}
    assert {name.split("/")[0] for name in files} >= {Path(name).parts[0] for name in HANDED_OUT}


@pytest.mark.parametrize("state", ["tracked", "new", "ignored", "without git"])
@pytest.mark.parametrize("name", PRIVATE)
def test_a_file_of_the_staffs_is_refused_in_git_and_without(checkout, name, state):
    plant(checkout, f"notebooks/{name}")
    if state == "tracked":
        git(checkout, "add", "--force", "--all")
    elif state == "ignored":
        (checkout / ".gitignore").write_text("notebooks/*\n", "utf-8")
    elif state == "without git":
        shutil.rmtree(checkout / ".git")

    with pytest.raises(EditionError, match=f"notebooks/{name} is named like a file of the staff's"):
        choose_files(checkout)


def test_a_checkout_that_git_cannot_read_is_refused(checkout):
    (checkout / ".git" / "HEAD").write_text("nonsense", "utf-8")

    with pytest.raises(EditionError, match="git does not list the files of"):
        choose_files(checkout)


def test_a_copy_without_git_inside_of_another_repository_is_taken_as_it_is(checkout):
    shutil.copytree(checkout, copy := checkout / "copy", ignore=shutil.ignore_patterns(".git"))

    assert len(choose_files(copy)[0]) == 4


def test_git_takes_no_file_of_the_graders_by_accident(tmp_path):
    shutil.copy(edition.ROOT / ".gitignore", tmp_path)
    git(tmp_path, "init")
    ours = [plant(tmp_path, f"notebooks/{name}") for name in PRIVATE[:5]]

    told = subprocess.check_output(["git", "-C", tmp_path, "check-ignore", *ours], text=True)

    assert told.split() == ours
