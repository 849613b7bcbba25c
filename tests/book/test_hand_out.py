"""The edition on its way into the students' repository, here one on this machine."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.tools.installed import program

ROOT = Path(__file__).parents[2]


def git(repository: Path, *arguments: str) -> str:
    command = [program("git", "git"), "-C", str(repository), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    git(tmp_path, "init", "--quiet", "--bare", "students.git")
    return tmp_path / "students.git"


@pytest.fixture
def edition(tmp_path: Path) -> Path:
    for name in ("lab/README.md", "lab/.gitignore", "lab/old.md", "html/_static/a.css"):
        file = tmp_path / "edition" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(name, "utf-8")
    return tmp_path / "edition"


def hand_out(repository: Path, edition: Path) -> subprocess.CompletedProcess[str]:
    command = [program("bash", "bash"), ".ci/hand-out", str(repository), str(edition)]
    return subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)


def files(repository: Path, branch: str) -> list[str]:
    return git(repository, "ls-tree", "-r", "--name-only", branch).split()


def test_the_lab_is_on_main_and_its_pages_alone_are_on_gh_pages(repository, edition):
    done = hand_out(repository, edition)

    assert done.returncode == 0, done.stderr
    assert files(repository, "main") == [".gitignore", "README.md", "old.md"]
    assert files(repository, "gh-pages") == [".nojekyll", "_static/a.css"]


def test_a_second_time_adds_one_commit_takes_away_what_is_gone_and_keeps_the_history(
    repository, edition
):
    hand_out(repository, edition)
    (edition / "lab" / "old.md").unlink()

    hand_out(repository, edition)
    hand_out(repository, edition)  # nothing is new

    assert files(repository, "main") == [".gitignore", "README.md"]
    assert git(repository, "rev-list", "--count", "main").strip() == "2"
    assert git(repository, "rev-list", "--count", "gh-pages").strip() == "1"


@pytest.mark.parametrize("lacking", ["repository", "edition"])
def test_where_something_is_lacking_it_says_so(tmp_path, repository, edition, lacking):
    nowhere = tmp_path / "nowhere"

    done = hand_out(
        nowhere if lacking == "repository" else repository,
        tmp_path if lacking == "edition" else edition,
    )

    assert done.returncode == 1
    assert done.stderr.startswith("hand-out: ")
