"""The command line as a whole: help, exit statuses, and what an interruption leaves behind."""

import os
import subprocess
import sys

import numpy as np
import pytest

import labkit
from labkit.cli.main import build_parser

MODULE = ["-m", "labkit"]


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


def test_a_code_page_without_a_sign_ends_no_run(tmp_path, carmen_log):
    """As where output goes to a file on Windows: a sign it does not know becomes a `?`."""
    (tmp_path / "Ω.log").write_text(carmen_log[0].read_text())
    env = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = python(*MODULE, "odometry", "Ω.log", "--out", "none", cwd=tmp_path, env=env)
    assert (done.returncode, done.stderr, "?: 8 scans" in done.stdout) == (0, "", True)


def test_a_reader_that_stops_early_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    done = python(*MODULE, "demo", stdout=writing)
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


# A job in the background is born deaf to SIGINT, and so are its children.
HEARING = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
INTERRUPTED = "\nlabkit: interrupted; no file is left half-written\n"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for a child alone")
@pytest.mark.parametrize("module", ["labkit.cli.main", "scipy", "labkit.odometry.step"])
def test_ctrl_c_while_the_command_loads_prints_no_traceback(module):
    """As in the first second: the signal arrives when `module` is about to be imported."""
    program = HEARING + (
        "import os, sys; from labkit.__main__ import main\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder()); sys.exit(main())"
    )
    done = python("-c", program, "--help")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", INTERRUPTED)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for a child alone")
def test_ctrl_c_leaves_no_file(tmp_path, carmen_log):
    """The signal arrives at the twentieth of 40 scans: the command says so and writes nothing."""
    log, _ = carmen_log
    long_log = tmp_path / "long.log"
    long_log.write_text(log.read_text() * 5)
    folder = tmp_path / "out"
    folder.mkdir()
    program = HEARING + (
        "import os, sys; from labkit.__main__ import main; from labkit.cli import odometry\n"
        "progress = odometry.tqdm\n"
        "def interrupted(scans, **options):\n"
        "    for k, scan in enumerate(progress(scans, **options)):\n"
        "        if k == 20: os.kill(os.getpid(), signal.SIGINT)\n"
        "        yield scan\n"
        "odometry.tqdm = interrupted; sys.exit(main())"
    )
    done = python("-c", program, "odometry", long_log, cwd=folder)
    assert done.returncode == 130
    assert "40 scans" in done.stdout
    assert done.stderr.endswith(INTERRUPTED)
    assert "Traceback" not in done.stderr
    assert list(folder.iterdir()) == []
