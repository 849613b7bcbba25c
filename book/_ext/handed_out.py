"""Which files of a checkout students get: those that git tracks in these folders, and no other.

A file beside them may be a secret, a mark or a draft. Where there is no git, the folders are
taken as they are. In either case a name of the staff's files stops the edition, be the file
tracked, ignored or new: the folders that students get are no place for it.
"""

from __future__ import annotations

import subprocess
from fnmatch import fnmatch
from pathlib import Path

HANDED_OUT = (
    "_config.yml",
    "_toc.yml",
    "book",
    "labkit",
    "notebooks",
    "tests/conformance",  # pages include its tables
    "LICENSE",
    "LICENSE-TEXT",
    "Makefile",
    "pyproject.toml",
    "requirements.txt",
    ".binder",
    ".devcontainer",
    ".github/ISSUE_TEMPLATE/question.yml",
    ".gitignore",
)
KEPT_BACK = (
    "book/benchmark.md",
    "book/decisions.md",
    "book/host.md",
    "book/_static/benchmark*",
    "labkit/course/authoring/*",
    "labkit/course/assignment/hidden*",
)
MADE_HERE = (  # by a run, so nobody misses them
    "book/_static/vendor/*",
    "*/.*_cache/*",
    "*/.ipynb_checkpoints/*",
    "*/__pycache__/*",
    "*.pyc",
)
STAFF = (  # what the grader reads and writes, and any archive
    "*.secret*",
    "grades",
    "submissions",
    "submitted",
    "verdicts",
    "*gradebook*.csv",
    "*gradebook*.xlsx",
    "*grades*.csv",  # as Canvas and Moodle name what they export
    "*grades*.xlsx",
    "adjustments*.csv",
    "roster*.csv",
    "scores*.csv",
    "*.7z",
    "*.rar",
    "*.tar",
    "*.tar.*",
    "*.tgz",
    "*.zip",
)


class EditionError(Exception):
    """The edition cannot be written; the message says why and what to do."""


def choose_files(root: Path) -> tuple[list[Path], list[str]]:
    """Files of a checkout that students get, and names of those that git does not track.

    Raises
    ------
    EditionError
        For a file with a name like those that the grader writes, and for an archive.
    """
    inside = sorted(file for name in HANDED_OUT for file in _files(root / name))
    names = [file.relative_to(root).as_posix() for file in inside]
    names = [name for name in names if not _fits(name, KEPT_BACK + MADE_HERE)]
    tracked = tracked_files(root)
    chosen = [name for name in names if tracked is None or name in tracked]
    for name in names:
        if any(_fits(part.lower(), STAFF) for part in name.split("/")):
            raise EditionError(
                f"{name} is named like a file of the staff's; move it out of the folders that "
                f"students get, or rename it"
            )
    return [root / name for name in chosen], sorted(set(names) - set(chosen))


def tracked_files(root: Path) -> frozenset[str] | None:
    """Names of the files that git tracks in a checkout; None where it is no checkout."""
    if not any((folder / ".git").exists() for folder in (root, *root.parents)):
        return None
    command = ["git", "-C", str(root), "ls-files", "-z", "--", *HANDED_OUT]
    try:
        listing = subprocess.run(command, capture_output=True, check=True, encoding="utf-8")
    except FileNotFoundError:
        raise EditionError(
            f"{root} is a git checkout, and git is not installed: install it, since students get "
            f"the files that it tracks"
        ) from None
    except subprocess.CalledProcessError as error:
        raise EditionError(f"git does not list the files of {root}:\n{error.stderr}") from None
    names = frozenset(filter(None, listing.stdout.split("\0")))
    return names if "pyproject.toml" in names else None  # a copy inside of another repository


def _files(start: Path) -> list[Path]:
    return [start] if start.is_file() else [file for file in start.rglob("*") if file.is_file()]


def _fits(name: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatch(name, pattern) for pattern in patterns)
