"""What is installed: data files, pins and their lock, and a version that has its entry."""

import re
import tomllib
from pathlib import Path

import pytest

import labkit

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
LOCKS = ("requirements.lock", "requirements-test.lock")


def pins(name):
    """Normalised names and versions of a requirements file; extras are left out."""
    text = (ROOT / name).read_text("utf-8")
    found = re.findall(r"(?m)^([A-Za-z0-9._-]+)(?:\[[^]]*\])?==([^\s;]+)", text)
    return {(re.sub(r"[-_.]+", "-", package).lower(), version) for package, version in found}


def test_every_data_file_is_in_the_wheel():
    packed = {
        path
        for package, patterns in PROJECT["tool"]["setuptools"]["package-data"].items()
        for pattern in patterns
        for path in ROOT.joinpath(*package.split(".")).glob(pattern)
    }
    files = (path for path in (ROOT / "labkit").rglob("*") if path.is_file())
    data = {path for path in files if path.suffix not in {".py", ".pyc", ".nbi", ".nbc"}}
    assert len(data) > 20
    assert data - packed == set()


def test_the_locks_hold_every_pin():
    locked = pins("requirements.lock")
    assert pins("requirements.txt") <= locked, "run `make lock`"
    assert pins("requirements-test.txt") <= locked | pins("requirements-test.lock")


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_has_hashes_and_says_no_host(name):
    lock = (ROOT / name).read_text("utf-8")
    entries = re.split(r"(?m)^(?=\S)", lock)[1:]
    assert len(entries) > 20
    assert all("--hash=sha256:" in entry for entry in entries)
    assert not re.search(r"https?:|index-url|@ ", lock)


@pytest.mark.parametrize("requirement", PROJECT["project"]["dependencies"])
def test_a_dependency_has_a_lower_bound_that_the_pins_keep(requirement):
    name, _, lowest = requirement.partition(">=")
    (version,) = (version for package, version in pins("requirements.txt") if package == name)
    assert [int(part) for part in version.split(".")] >= [int(part) for part in lowest.split(".")]


def test_the_version_has_its_entry():
    assert re.search(
        rf"(?m)^## {re.escape(labkit.__version__)}\b", (ROOT / "CHANGELOG.md").read_text("utf-8")
    )
