"""What is installed: data files and the lock; and what workflows leave behind."""

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version
from setuptools import find_packages

from labkit.support.extras import DISTRIBUTION

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
LOCK = (ROOT / "requirements-dev.txt").read_text("utf-8")
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
LAB = (ROOT / "requirements.txt").read_text("utf-8")  # the part that every reader needs


def versions(lock=LOCK):
    """The locked version of each package, by its normalised name."""
    found = re.findall(r"(?m)^([A-Za-z0-9._-]+)(?:\[[^]]*\])?==([^\s;]+)", lock)
    return {re.sub(r"[-_.]+", "-", name).lower(): Version(version) for name, version in found}


def requirements():
    """All that pyproject.toml names: the package's own needs, its extras and the groups."""
    project = PROJECT["project"]
    named = [project["dependencies"], *project["optional-dependencies"].values()]
    named += PROJECT["dependency-groups"].values()
    each = {Requirement(text) for texts in named for text in texts}
    return sorted((one for one in each if one.name != DISTRIBUTION), key=str)


def test_messages_name_the_distribution_that_pip_knows():
    assert PROJECT["project"]["name"] == DISTRIBUTION


def test_every_data_file_is_in_the_wheel():
    packed = {
        path
        for package, patterns in PROJECT["tool"]["setuptools"]["package-data"].items()
        for pattern in patterns
        for path in ROOT.joinpath(*package.split(".")).glob(pattern)
    }
    files = (path for path in (ROOT / "labkit").rglob("*") if path.is_file())
    data = {path for path in files if path.suffix not in {".py", ".pyc", ".nbi", ".nbc", ".md"}}
    assert len(data) > 20
    assert data - packed == set()


def test_the_wheel_has_all_packages_but_the_authors():
    found = find_packages(str(ROOT), **PROJECT["tool"]["setuptools"]["packages"]["find"])
    inits = (path.parent for path in (ROOT / "labkit").rglob("__init__.py"))
    everything = {".".join(folder.relative_to(ROOT).parts) for folder in inits}

    missing = everything - set(found)

    assert missing == {"labkit.course.authoring", "labkit.course.authoring.questions"}


@pytest.mark.parametrize("requirement", requirements(), ids=str)
def test_the_lock_holds_what_pyproject_asks_for(requirement):
    name = re.sub(r"[-_.]+", "-", requirement.name).lower()
    assert versions()[name] in requirement.specifier, "run `make lock`"


def test_the_labs_own_list_has_the_same_versions_and_fewer():
    lab, everything = versions(LAB), versions()
    assert lab.items() < everything.items(), "run `make lock`"


@pytest.mark.parametrize("lock", [LOCK, LAB], ids=["authors", "lab"])
def test_a_lock_has_hashes_and_says_no_host(lock):
    entries = re.split(r"(?m)^(?=\w)", lock)
    assert len(entries) > 100
    assert all("--hash=sha256:" in entry for entry in entries if entry)
    assert not re.search(r"https?:|index-url|@ ", lock)


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_a_checkout_leaves_no_credentials_behind(workflow):
    """Each names its commit, too: a tag can be moved to other code."""
    text = workflow.read_text("utf-8")
    steps = re.findall(r"(?m)^( +)- uses: (\S+)[^\n]*\n((?:\1 +[^\n]*\n)*)", text)
    assert steps
    for _, action, options in steps:
        name, commit = action.split("@")
        assert re.fullmatch("[0-9a-f]{40}", commit), action
        assert name != "actions/checkout" or "persist-credentials: false" in options, options
