"""The command line as a whole: help, exit statuses, and what an interruption leaves behind."""

import os
import subprocess
import sys

import numpy as np
import pytest

import labkit
from labkit.cli.main import build_parser

MODULE = ["-m", "labkit"]
LINE = "\nlabkit: interrupted; no file is left half-written\n"


def python(*arguments, **options):
    """What a new process of Python ends with."""
    command = [sys.executable, *map(str, arguments)]
    options = {"stdout": subprocess.PIPE, "encoding": "utf-8"} | options
    return subprocess.run(command, stderr=subprocess.PIPE, check=False, **options)


def test_the_version_names_the_packages_without_loading_numba():
    program = "import sys; from labkit.cli import main\ntry: main()\nexcept SystemExit: "
    program += "print(sorted({'numba', 'llvmlite'} & sys.modules.keys()))"
    line, loaded = python("-c", program, "--version").stdout.splitlines()
    assert line.startswith(f"labkit {labkit.__version__} (Python ")
    assert f", numpy {np.__version__}, scipy " in line
    assert ", numba " in line or ", without numba" in line
    assert loaded == "[]"


def test_the_help_names_every_command_and_each_explains_itself(run):
    """The law: each command of the parser, whoever added it."""
    parser = build_parser()
    (commands,) = (each.choices for each in parser._actions if isinstance(each.choices, dict))
    assert {"autograder", "grade", "odometry"} <= commands.keys()
    listed = parser.format_help().partition("commands:")[2]
    for command in commands:
        assert f"\n    {command}" in listed
        status, out, _ = run(command, "--help")
        assert (status, f"usage: labkit {command}" in out) == (0, True)


def test_the_demo_shows_the_lesson_s_numbers(run):
    status, out, err = run("demo")
    assert (status, err) == (0, "")
    assert "truth       t = (0.3500, 0.1000) m, theta = 6.000 deg" in out
    assert "estimate    t = (0.3496, 0.1008) m, theta = 6.011 deg" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "required: COMMAND"),
        (("odometry",), "the following arguments are required: LOG"),
        (("odometry", "a", "--gate", "wide"), "argument --gate: invalid float value: 'wide'"),
        (("odometry", "killian", "--overlap", "2"), "--overlap must be in (0, 1], got 2.0"),
        (("odometry", "killian", "--scans", "1"), "--scans must be a whole number of at least 2"),
        (("odometry", "killian", "--angles", "-90", "89"), "--angles must be radians within one"),
    ],
)
def test_a_wrong_command_line_ends_with_2(run, arguments, message):
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert "Traceback" not in err


def complaints(done):
    """Lines on stderr, but for the one where an empty cache makes the matcher compile."""
    return [line for line in done.stderr.splitlines() if not line.startswith("compiling ")]


def test_a_code_page_without_a_sign_ends_no_run(tmp_path, carmen_log):
    """As where output goes to a file on Windows: a sign it does not know becomes a `?`."""
    (tmp_path / "Ω.log").write_text(carmen_log[0].read_text())
    env = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = python(*MODULE, "odometry", "Ω.log", "--out", "none", cwd=tmp_path, env=env)
    assert (done.returncode, complaints(done), "?: 8 scans" in done.stdout) == (0, [], True)


def test_a_reader_that_stops_early_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    done = python(*MODULE, "demo", stdout=writing)
    os.close(writing)
    assert (done.returncode, complaints(done)) == (0, [])


def nightly(case):
    return pytest.param(case, marks=pytest.mark.nightly)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for a child alone")
@pytest.mark.parametrize(
    "module",
    [
        None,
        "scipy",
        *map(nightly, ("labkit.cli.main", "labkit.odometry.match", "matplotlib.figure")),
    ],
)
def test_ctrl_c_ends_in_one_line_and_leaves_no_file_half_written(tmp_path, carmen_log, module):
    """While it loads, when `module` is about to be imported; at the fifth scan; before the map."""
    program = (  # a job in the background is born deaf to SIGINT, and so are its children
        "import os, signal, sys; from labkit.__main__ import main\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def interrupt(when):\n"
        "    if when: os.kill(os.getpid(), signal.SIGINT)\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        interrupt(name == {module!r})\n"
        "def show_progress(scans, doing, unit):\n"
        "    for k, scan in enumerate(scans):\n"
        f"        interrupt(k == 5 and doing == 'matching' and {module is None})\n"
        "        yield scan\n"
        "import labkit.support.progress as p; p.show_progress = show_progress\n"
        "sys.meta_path.insert(0, Finder()); sys.exit(main())"
    )
    done = python("-c", program, "odometry", carmen_log[0], cwd=tmp_path)
    assert (done.returncode, done.stderr) == (130, LINE)
    whole = ["room-odometry.tum", "room-quality.csv"] if module == "matplotlib.figure" else []
    assert sorted(os.listdir(tmp_path)) == whole
    lines = [len((tmp_path / name).read_text().splitlines()) for name in whole]
    assert lines == [10, 9][: len(whole)]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for a child alone")
@pytest.mark.parametrize("module", ["labkit.alignment", "numpy", "scipy", "labkit.cli.main"])
@pytest.mark.parametrize(
    "start", [MODULE, *map(nightly, (["labkit"], ["-c", "import labkit.cli"]))]
)
def test_ctrl_c_while_a_command_loads_ends_it_and_is_an_error_where_labkit_is_imported(
    tmp_path, start, module
):
    """The law: each way to start the command × each package that it loads."""
    (tmp_path / "labkit").write_text("from labkit.__main__ import main; raise SystemExit(main())")
    (tmp_path / "sitecustomize.py").write_text(
        "import os, signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())"
    )
    env = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = python(*start, "demo", cwd=tmp_path, env=env)
    if start[0] == "-c":
        assert done.stderr.endswith("\nKeyboardInterrupt\n")
    else:
        assert (done.returncode, done.stdout, done.stderr) == (130, "", LINE)
