"""Other systems, played here: Pythons that lack what macOS or Windows lack, and all they start.

Their start-up takes away modules and functions and changes the system's name, in every process
of the command, so that the real path is run and no part of it replaced. Collecting imports
every module and every test, as the continuous integration on those systems does first.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import labkit

ROOT = Path(labkit.__file__).parents[1]
WITHOUT = """
import os, sys, sysconfig
sysconfig.get_config_vars()  # which are filed under the real system's name
import asyncio, ctypes, ctypes.util, multiprocessing.connection, signal, socket, subprocess, uuid
import multiprocessing.popen_spawn_posix, multiprocessing.reduction, shutil, tempfile
import urllib.request, webbrowser
import numpy, scipy.spatial
# These ask for the system when they are imported; numba, for its compiler's library of that name.
for other in ("psutil", "platformdirs", "locket", "numba"):
    try:
        __import__(other)
    except ImportError:
        pass

lost = {
    os: ["pidfd_open", "sched_getaffinity", "unshare", "setns", "setresuid", "setresgid"],
    socket: ["SOCK_SEQPACKET", "SO_PASSCRED"],
}
if os.environ["LABKIT_LACKS"] == "win32":
    sys.modules["resource"] = sys.modules["fcntl"] = None
    lost[os] += ["geteuid", "getuid", "setuid", "fork", "uname", "killpg", "chown", "setsid"]
    lost[socket] += ["AF_UNIX", "send_fds", "recv_fds"]
    lost[signal] = ["getitimer", "setitimer", "SIGKILL", "alarm"]
    real = ctypes.CDLL
    def loaded(name, *given, **more):
        if name is None:
            raise TypeError("argument of type 'NoneType' is not iterable")
        return real(name, *given, **more)
    ctypes.CDLL = loaded
for module, names in lost.items():
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
sys.platform = os.environ["LABKIT_SYSTEM"]
"""


@pytest.fixture(params=["darwin", "win32"])
def elsewhere(request, tmp_path):
    """Run a Python that believes to be on another system."""
    if sys.platform != "linux":
        pytest.skip("this is such a system itself")
    (tmp_path / "start").mkdir()
    (tmp_path / "start/sitecustomize.py").write_text(WITHOUT, "utf-8")

    def run(*arguments, cwd=ROOT, called=request.param):
        given = {"LABKIT_LACKS": request.param, "LABKIT_SYSTEM": called}
        return subprocess.run(
            [sys.executable, *map(str, arguments)],
            env=os.environ | given | {"PYTHONPATH": str(tmp_path / "start")},
            cwd=cwd,
            capture_output=True,
            text=True,
            check=False,
        )

    run.system = request.param
    return run


SAYS = """
from labkit.errors import LabkitError
from labkit.course.grading.sandbox.host import available_modes, open_sandbox
try:
    open_sandbox()
except LabkitError as error:
    print(error)
print(available_modes())
"""


def test_the_default_mode_says_that_there_is_none_and_what_to_do(elsewhere):
    ended = elsewhere("-c", SAYS)
    assert ended.returncode == 0, ended.stderr
    assert "no safe mode of isolation works here" in ended.stdout
    assert ended.stdout.count(f"it needs Linux, and this is {elsewhere.system}") == 6
    assert "--no-isolation" in ended.stdout
    assert "'none': ''" in ended.stdout


@pytest.mark.parametrize("elsewhere", ["darwin"], indirect=True)  # no spawning as Windows does
def test_the_command_says_so_too(elsewhere, tmp_path):
    (tmp_path / "class").mkdir()
    (tmp_path / "class/ada.py").write_text("def rotation(angle):\n    return angle\n", "utf-8")
    ended = elsewhere("-m", "labkit", "grade", "class", cwd=tmp_path)
    assert ended.returncode != 0
    assert "no safe mode of isolation works here" in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize("elsewhere", ["win32"], indirect=True)  # it lacks what macOS lacks
def test_every_module_is_imported_and_every_doctest_found(elsewhere):
    words = [
        "-q",
        "--collect-only",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:nbval",
        "labkit",
        "tests/course/grading",
    ]
    ended = elsewhere("-m", "pytest", *words, called="darwin")  # pytest itself knows Windows
    assert ended.returncode == 0, ended.stdout[-2000:] + ended.stderr[-2000:]
    assert "labkit/course/grading/sandbox/host/modes.py::labkit" in ended.stdout
