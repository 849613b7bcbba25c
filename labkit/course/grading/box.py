"""The box: one throw-away process for each submission, and what stands around it.

bubblewrap
    an empty file system with Python, numpy and scipy in it; no network, no other process.
user
    for root in a container that allows no namespaces: an unused user, who can read what all can.
none
    the same command with nothing around it, but for limits.

In the first two a filter of system calls refuses the network and new processes.
"""

from __future__ import annotations

import atexit
import base64
import compileall
import contextlib
import importlib
import importlib.util
import json
import os
import random
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from labkit.course.grading.contract import Limits
from labkit.course.grading.inside import data
from labkit.errors import LabkitError
from labkit.extras import MissingExtraError

MEBIBYTE = 1 << 20
MEMORY = 1536 * MEBIBYTE
FILE_BYTES = 16 * MEBIBYTE
DISK_BYTES = 64 * MEBIBYTE
MAX_LINE = 4 * MEBIBYTE
START = 60.0  # [s] until a box must be ready, on a machine at its limit
PACKAGE = Path(__file__).resolve().parents[2]
KIT = "/kit"
OWN = "labkit/course/grading/inside"
SYSTEM = ("/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/alternatives")
USERS = range(50_000, 60_000)  # above people, below those that systemd gives to services
ENVIRONMENT = {
    "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "HOME": "/box", "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
}  # fmt: skip
COMMAND = (
    "import sys; sys.path.insert(0, {kit!r}); "
    "from labkit.course.grading.inside.main import main; main()"
)
PROBE = """
import os, socket

def holes(paths):
    def read(path):
        os.listdir(path) if os.path.isdir(path) else open(path, "rb").close()

    def fork():
        if os.fork() == 0:
            os._exit(0)

    found = []
    trials = [(f"it can read {path}", lambda path=path: read(path)) for path in paths]
    trials += [("it can open sockets", socket.socket), ("it can start processes", fork)]
    for says, trial in trials:
        try:
            trial()
            found.append(says)
        except OSError:
            pass
    return found
"""


class BoxError(Exception):
    """The box ended, took too long or said what it must not; nothing more comes from it."""


@dataclass(frozen=True, kw_only=True)
class Wall:
    """What stands around a box.

    Attributes
    ----------
    mode : {"bubblewrap", "user", "none"}
    hidden : tuple of str
        Folders that must not be readable in it: the assignment, the submissions, the marks.
    """

    mode: str
    hidden: tuple[str, ...] = ()


def open_wall(hidden: Sequence[str | os.PathLike[str]], *, isolation: bool = True) -> Wall:
    """The strongest wall that works here, tried with a box that looks for holes.

    Raises
    ------
    LabkitError
        Where none does; the message says why, and what to do.
    """
    paths = tuple(os.path.realpath(path) for path in hidden)
    if not isolation and os.name == "posix":
        return Wall(mode="none")
    reasons = []
    for mode in ("bubblewrap", "user"):
        wall = Wall(mode=mode, hidden=paths)
        reason = why_not(wall)
        if not reason:
            return wall
        reasons.append(f"{mode}: {reason}")
    raise LabkitError(
        f"no isolation works here ({'; '.join(reasons)}). On Linux install bubblewrap; on other "
        f"systems run the grader in a Linux container. --no-isolation runs students' code with "
        f"your own rights, which is not safe"
    )


def why_not(wall: Wall) -> str:
    """What keeps a wall from holding here; empty where it holds."""
    if sys.platform != "linux":
        return "this is not Linux"
    if wall.mode == "bubblewrap" and not shutil.which("bwrap"):
        return "bubblewrap is not installed"
    if wall.mode == "user" and os.geteuid() != 0:
        return "it needs root, as in a container"
    files = {"probe.py": PROBE.encode()}
    end = time.monotonic() + START
    try:
        with Box(wall, Limits()) as box:
            box.read(files, ["holes"], [], end)
            while "answers" not in box.receive(end):
                pass
            paths = {"tuple": [*wall.hidden, "/etc/shadow"]}
            box.ask("holes", "own", {}, [[paths]], end)
            answer = box.receive(end)
    except (BoxError, OSError) as error:
        return str(error) or type(error).__name__
    holes = data.from_json(answer.get("value"))
    return " and ".join(holes) if isinstance(holes, tuple) else f"it fails: {answer}"


class Box:
    """A running box; a context manager.

    Parameters
    ----------
    wall : Wall
        What stands around it.
    limits : Limits
        What it may use.
    """

    def __init__(self, wall: Wall, limits: Limits) -> None:
        self.limits = limits
        self._buffer = b""
        self._resources = contextlib.ExitStack()
        settings = {
            "seconds": limits.processor,
            "memory": MEMORY,
            "file_bytes": 0 if wall.mode == "user" else FILE_BYTES,
            "user": self._user() if wall.mode != "none" and os.geteuid() == 0 else 0,
            "isolated": wall.mode != "none",
        }
        kit = KIT if wall.mode == "bubblewrap" else kit_folder()
        command = [os.path.realpath(sys.executable), "-I", "-S", "-B", "-X", "utf8", "-c"]
        command += [COMMAND.format(kit=kit), json.dumps(settings)]
        folder = None
        if wall.mode == "bubblewrap":
            command = [*bubblewrap(wall), *command]
        elif wall.mode == "none":
            folder = self._resources.enter_context(tempfile.TemporaryDirectory(prefix="labkit-"))
        self.process = subprocess.Popen(
            command,
            env=ENVIRONMENT,
            cwd=folder or "/",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,
        )
        try:
            for pipe in (self.process.stdin, self.process.stdout):
                assert pipe is not None
                os.set_blocking(pipe.fileno(), False)
            if self.receive(time.monotonic() + START) != {"ready": True}:
                raise BoxError("the box is not ready")
        except BaseException as error:
            complaint = self.close()
            if isinstance(error, BoxError):
                raise BoxError(complaint or "the box did not start") from None
            raise

    def _user(self) -> int:
        return self._resources.enter_context(unused_user())

    def __enter__(self) -> Box:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> str:
        """End it, with all that runs in it; the last line that it complained with."""
        self.process.kill()
        with contextlib.suppress(ValueError):
            _, complaint = self.process.communicate()
        self._resources.close()
        return complaint.decode(errors="replace").strip().rpartition("\n")[2]

    def read(
        self, files: dict[str, bytes], functions: Sequence[str], skipped: Sequence[int], end: float
    ) -> None:
        """Have the submission run; `receive` then tells of each cell, and of all in the end."""
        packed = {name: base64.b64encode(content).decode() for name, content in files.items()}
        self._send(
            end, files=packed, functions=functions, seconds=self.limits.seconds, skipped=skipped
        )

    def ask(
        self, function: str, state: str, right: dict[str, str], calls: Sequence[Any], end: float
    ) -> None:
        """Have a function called; `receive` then gives the outcome of each call."""
        self._send(
            end,
            function=function,
            state=state,
            right=right,
            calls=calls,
            seconds=self.limits.seconds,
        )

    def _send(self, end: float, **order: Any) -> None:
        line = memoryview(json.dumps(order).encode("ascii") + b"\n")
        assert self.process.stdin is not None
        number = self.process.stdin.fileno()
        while line:
            self._wait(number, select.POLLOUT, end)
            try:
                line = line[os.write(number, line[:65536]) :]
            except OSError:
                raise BoxError("the program ended") from None

    def receive(self, end: float) -> dict[str, Any]:
        """The next thing that the box says.

        Raises
        ------
        BoxError
            Where nothing comes until `end`, a clock time, or what comes is no answer.
        """
        assert self.process.stdout is not None
        number = self.process.stdout.fileno()
        while b"\n" not in self._buffer:
            self._wait(number, select.POLLIN, end)
            try:
                read = os.read(number, 1 << 20)
            except BlockingIOError:
                continue
            self._buffer += read
            if not read:
                raise BoxError("the program ended")
            if len(self._buffer) > MAX_LINE:
                raise BoxError("it said too much")
        line, _, self._buffer = self._buffer.partition(b"\n")
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            answer = None
        if not isinstance(answer, dict):
            raise BoxError("it spoke out of turn")
        return answer

    @staticmethod
    def _wait(number: int, event: int, end: float) -> None:
        left = end - time.monotonic()
        waiting = select.poll()
        waiting.register(number, event)
        if left <= 0 or not waiting.poll(1000 * left):
            raise BoxError("it took too long")


def bubblewrap(wall: Wall) -> list[str]:
    """The command that closes a box around the command that follows it."""
    roots = [path for path in (*SYSTEM, sys.base_prefix) if os.path.exists(path)]
    command = ["bwrap", "--unshare-pid", "--unshare-net", "--unshare-ipc", "--unshare-uts"]
    command += ["--unshare-cgroup-try", "--die-with-parent", "--new-session"]
    if os.geteuid() == 0:  # it becomes another user by itself
        command += ["--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID"]
    else:
        command += ["--unshare-user"]
    mounts = {path: path for path in roots}
    mounts |= {f"{KIT}/{name}": path for name, path in libraries().items()}
    above = {str(folder) for place in mounts for folder in Path(place).parents} - {"/"}
    for folder in sorted(above - mounts.keys()):
        command += ["--perms", "0755", "--dir", folder]
    for place, path in mounts.items():
        command += ["--ro-bind", path, place]
    for path in (str(PACKAGE), *wall.hidden):
        if os.path.isdir(path) and any(Path(path).is_relative_to(root) for root in roots):
            command += ["--tmpfs", path]
    command += ["--dev", "/dev", "--size", str(DISK_BYTES), "--perms", "1777", "--tmpfs", "/box"]
    return [*command, "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/box", "--"]


@cache
def libraries() -> dict[str, str]:
    """What can be imported in a box besides Python's own library: the folder of each."""
    if importlib.util.find_spec("IPython") is None:
        raise MissingExtraError("grading", "IPython", "grading")
    found = {OWN: str(PACKAGE.parent / OWN)}
    compileall.compile_dir(found[OWN], quiet=2)  # once here, and not in each box
    for name in ("numpy", "scipy", "IPython"):
        spec = importlib.util.find_spec(name)
        for folder in (spec and spec.submodule_search_locations) or []:
            found[name] = os.path.realpath(folder)
            if os.path.isdir(libs := f"{folder}.libs"):
                found[f"{name}.libs"] = os.path.realpath(libs)
    return found


@cache
def kit_folder() -> str:
    """A folder with the same in it, for boxes without a file system of their own."""
    kit = Path(tempfile.mkdtemp(prefix="labkit-kit-"))
    atexit.register(shutil.rmtree, kit, ignore_errors=True)
    for name, path in libraries().items():
        if name == OWN:
            shutil.copytree(path, kit / name)
        else:
            (kit / name).symlink_to(path)
    kit.chmod(0o755)
    return str(kit)


@contextlib.contextmanager
def unused_user() -> Iterator[int]:
    """A user that nobody is: no account, no running process, no other box has it."""
    fcntl, pwd = map(importlib.import_module, ("fcntl", "pwd"))  # Windows has none
    folder = Path("/run/labkit-users")
    folder.mkdir(mode=0o700, exist_ok=True)
    running = {_owner(path) for path in Path("/proc").iterdir() if path.name.isdigit()}
    accounts = {entry.pw_uid for entry in pwd.getpwall()}
    for user in random.sample(USERS, 200):
        if user in running or user in accounts:
            continue
        with (folder / str(user)).open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            try:
                yield user
            finally:
                (folder / str(user)).unlink(missing_ok=True)
            return
    raise BoxError(f"200 users from {USERS[0]} on are all taken")


def _owner(path: Path) -> int:
    try:
        return path.stat().st_uid
    except OSError:
        return -1
