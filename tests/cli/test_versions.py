"""What a bug report needs in one line: the versions of what runs, told without loading it."""

import importlib
import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from importlib.util import find_spec

import pytest

import labkit
from labkit.cli import versions


def own_version(package):
    """What a package says of itself once it is imported: a second source."""
    return importlib.import_module(package).__version__


def test_every_version_is_the_one_that_runs(run):
    command = [sys.executable, "--version"]
    python = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    numba = f"numba {own_version('numba')}" if find_spec("numba") else "without numba"
    status, out, err = run("--version")
    assert (status, err) == (0, "")
    assert out == (
        f"labkit {labkit.__version__} ({python}, numpy {own_version('numpy')}, "
        f"scipy {own_version('scipy')}, {numba})\n"
    )


def test_without_numba_the_line_says_so(run, monkeypatch):
    monkeypatch.setattr(versions, "is_available", lambda: False)
    status, out, _ = run("--version")
    assert status == 0
    assert out.endswith(f", scipy {own_version('scipy')}, without numba)\n")


def test_a_package_without_metadata_ends_no_report(run, monkeypatch):
    """As where it was copied to a folder of Python's path, not installed."""

    def unknown(package):
        raise PackageNotFoundError(package)

    monkeypatch.setattr(versions, "version", unknown)
    status, out, _ = run("--version")
    assert status == 0
    assert "numpy of unknown version, scipy of unknown version, " in out


@pytest.mark.skipif(not find_spec("numba"), reason="numba is not there to be imported")
def test_numba_is_not_imported_to_learn_its_version():
    program = (
        "import sys, labkit_command\n"
        "try: labkit_command.main()\n"
        "except SystemExit: print(sorted({'numba', 'llvmlite'} & sys.modules.keys()))"
    )
    command = [sys.executable, "-c", program, "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    line, loaded = done.stdout.splitlines()
    assert f"numba {own_version('numba')})" in line
    assert loaded == "[]"


def test_no_version_is_looked_up_before_it_is_asked_for(run, monkeypatch):
    """Each look-up reads a file, which no other command is to wait for."""
    monkeypatch.setattr(versions, "version", pytest.fail)
    assert run("--help")[0] == 0
