"""The box: one throw-away process for each submission, and what stands around it.

bubblewrap
    an empty file system with Python and the installed packages in it, without labkit; no network,
    no other process.
user
    for root in a container that allows no namespaces: an unused user, who can read what all can.
none
    the same command with nothing around it, but for limits.

In the first two the network and new processes are refused by a filter of system calls.
"""

from __future__ import annotations

import compileall
import contextlib
import importlib
import itertools
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import scipy

from labkit.grading.box.inside import data
from labkit.grading.box.inside.limits import DISK_BYTES, MAX_LINE, SECONDS, START, Time
from labkit.grading.box.watch import LOOK, BoxError, MachineError, Watch, read_usage
from labkit.support.errors import LabkitError

T = TypeVar("T")
ENDED = "the program ended"
PACKAGE = Path(__file__).resolve().parents[2]
OWN = str(PACKAGE / "grading/box/inside")
OWN_FONTS = "/box/matplotlib"  # its list of fonts takes long to make
SYSTEM = ("/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/alternatives")
# Above people, below the users that systemd gives to services; each grader in an order of its own.
USERS = itertools.cycle(random.sample(range(50_000, 60_000), 10_000))
ENVIRONMENT = {
    "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "HOME": "/box", "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "MPLBACKEND": "Agg", "NUMBA_DISABLE_JIT": "1",
}  # fmt: skip
COMMAND = """
import sys, types
for name in ("labkit", "labkit.grading", "labkit.grading.box"):
    sys.modules[name] = types.ModuleType(name)
sys.modules[name].__path__ = [{above!r}]
sys.path[:0] = {paths!r}
from labkit.grading.box.inside.session import main
main()
"""
PROBE = """
import os, socket
def holes(path):
    read = lambda: os.listdir(path)[0] if os.path.isdir(path) else open(path, "rb")
    trials = {f"read {path}": read, "open sockets": socket.socket,
              "start processes": lambda: os.fork() or os._exit(0)}
    found = []
    for says, trial in trials.items():
        try:
            trial()
            found.append("it can " + says)
        except (OSError, IndexError):
            pass
    return found
"""


class Wall(NamedTuple):
    """The wall around a box, and the time in it, from which all limits of time follow."""

    mode: str  # "bubblewrap", "user" or "none"
    hidden: tuple[str, ...] = ()  # paths that lie behind it
    seconds: float = SECONDS  # of processor time, for a cell and for a call [s]


@cache
def open_wall(
    hidden: tuple[str | Path, ...] = (), seconds: float = SECONDS, *, isolation: bool = True
) -> Wall:
    """The strongest wall that works here; `LabkitError` where none does, with what to do."""
    compileall.compile_dir(OWN, quiet=2)  # once here, and not in each box
    if not isolation and os.name == "posix":
        return Wall("none", seconds=seconds)
    reasons = []
    for mode in ("bubblewrap", "user"):
        wall = Wall(mode, tuple(map(os.path.realpath, hidden)), seconds)
        if not (reason := why_not(wall)):
            return wall
        reasons.append(f"{mode}: {reason}")
    raise LabkitError(
        f"no isolation works here ({'; '.join(reasons)}). On Linux install bubblewrap and "
        f"libseccomp; on other systems run the grader in a Linux container. --no-isolation runs "
        f"students' code with your own rights, which is not safe"
    )


def why_not(wall: Wall) -> str:
    """Reasons that keep a wall from holding here, tried with a box that looks for holes; or ""."""
    if sys.platform != "linux":
        return "this is not Linux"
    if wall.mode == "user" and os.geteuid() != 0:
        return "it needs root, as in a container"
    calls = [[path] for path in ("/etc/shadow", *wall.hidden)]
    try:
        with contextlib.closing(Box(wall)) as box:
            box.send(START, cells=[(PROBE, "probe")], scripts={}, functions=["holes"])
            while "answers" not in box.receive():
                pass
            box.send(START, function="holes", state=0, lent={}, in_form=[], calls=calls)
            holes = [hole for _ in calls for hole in data.from_json(box.receive()["value"])]
            return " and ".join(dict.fromkeys(holes))
    except (BoxError, LabkitError, OSError, KeyError) as error:
        return str(error) or type(error).__name__


class Box:
    """A running box behind a wall, which gets so many seconds of processor time in all."""

    def __init__(self, wall: Wall, seconds: float = Time().left) -> None:
        self.wall = wall
        self._buffer = bytearray()
        user = find_unused_user() if os.geteuid() == 0 and wall.mode != "none" else 0
        settings = {"seconds": seconds, "user": user, "wall": wall.mode}
        command = [os.path.realpath(sys.executable), "-I", "-S", "-B", "-X", "utf8", "-c"]
        above = os.path.dirname(OWN)
        command += [COMMAND.format(above=above, paths=packages()), json.dumps(settings)]
        fonts = os.environ.get("MPLCONFIGDIR", tempfile.gettempdir())  # one where it may write
        if wall.mode == "bubblewrap":
            command = [*bubblewrap(wall), *command]
            fonts = OWN_FONTS
        self._channel, theirs = socket.socketpair()
        self._channel.settimeout(LOOK)
        try:
            with theirs:
                self.process = subprocess.Popen(
                    command,
                    env=ENVIRONMENT | {"MPLCONFIGDIR": fonts},
                    cwd="/",
                    stdin=theirs.fileno(),
                    stdout=theirs.fileno(),
                    stderr=subprocess.PIPE,
                    start_new_session=True,
                )
        except OSError as error:  # its program is missing, or nobody may run it
            self._channel.close()
            raise MachineError(f"the box did not start: {error}") from None
        self._pid = 0  # of the process in the box, once it is there
        self.allow(START)
        try:
            self.receive()
        except (BoxError, MachineError) as error:
            raise MachineError(self.close() or f"the box did not start: {error}") from None
        self._pid = innermost(self.process.pid)

    def close(self) -> str:
        """End it, with all that runs in it; the last line that it complained with."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)  # with what it started, where it may
        _, complaint = self.process.communicate()
        self._channel.close()
        return complaint.decode(errors="replace").strip().rpartition("\n")[2]

    def send(self, allowed: float, attached: bytes = b"", /, **order: Any) -> None:
        """Order what `session` serves, with seconds of processor time for all answers."""
        line = json.dumps({"seconds": self.wall.seconds, **order})
        unsent = memoryview(line.encode() + b"\n" + attached)
        self.allow(allowed)
        while unsent:
            unsent = unsent[self._transfer(self._channel.send, unsent) :]

    def receive(self, max_bytes: int = MAX_LINE) -> dict[str, Any]:
        """The next answer; `BoxError` where none comes, `MachineError` by the machine's fault."""
        searched = 0
        while (newline := self._buffer.find(b"\n", searched)) < 0:
            searched = len(self._buffer)
            read = self._transfer(self._channel.recv, 1 << 16)
            self._buffer += read
            if not read or searched > max_bytes:
                raise BoxError("the program sent too much output" if read else ENDED)
        line = bytes(self._buffer[:newline])
        del self._buffer[: newline + 1]
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            answer = None
        if not isinstance(answer, dict):
            raise BoxError("the program sent an invalid answer")
        return answer

    def processor_time(self) -> float:
        """Seconds of processor time that the box has used."""
        usage = read_usage(self._pid)
        return usage.used if usage else self._watch.last.used

    def allow(self, seconds: float) -> None:
        """Allow the code so many seconds of processor time from now on."""
        self._watch = Watch(seconds, read_usage(self._pid), time.monotonic())

    def _transfer(self, move: Callable[[Any], T], argument: Any) -> T:
        """Result of a step on the channel, with a look at the time from time to time."""
        while True:
            now = time.monotonic()
            if now > self._watch.looked + LOOK:
                self._watch.look(read_usage(self._pid), now)
            try:
                return move(argument)
            except TimeoutError:
                continue
            except OSError:
                raise BoxError(ENDED) from None


def innermost(pid: int) -> int:
    """The process in the box, which bubblewrap starts through one or two of its own."""
    with contextlib.suppress(OSError):
        while children := Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            pid = int(children[0])
    return pid


def bubblewrap(wall: Wall) -> list[str]:
    """The command that closes a box around the command that follows it."""
    command = ["bwrap", "--unshare-pid", "--unshare-net", "--unshare-ipc", "--unshare-uts"]
    command += ["--unshare-cgroup-try", "--die-with-parent", "--new-session"]
    if os.geteuid() == 0:  # it becomes another user by itself
        command += ["--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID"]
    else:
        command += ["--unshare-user"]
    roots = [path for path in (*SYSTEM, sys.base_prefix, *packages()) if os.path.exists(path)]
    hidden = [path for path in (str(PACKAGE), *wall.hidden) if os.path.isdir(path)]
    hidden = [path for path in hidden if any(map(Path(path).is_relative_to, roots))]
    steps = [("--ro-bind", path, path) for path in roots] + [("--tmpfs", path) for path in hidden]
    for step in [*steps, ("--ro-bind", OWN, OWN)]:
        for above in list(Path(step[1]).parents)[-2::-1]:
            command += ["--perms", "0755", "--dir", str(above)]
        command += step
    command += [part for path in hidden for part in ("--remount-ro", path)]
    command += ["--dev", "/dev", "--size", str(DISK_BYTES), "--perms", "1777", "--tmpfs", "/box"]
    fonts_of_grader = os.environ.get("MPLCONFIGDIR", Path.home() / ".cache/matplotlib")
    for fonts in Path(fonts_of_grader).glob("fontlist-*.json"):  # which take long to list
        command += ["--perms", "0777", "--dir", OWN_FONTS]
        command += ["--ro-bind", str(fonts), f"{OWN_FONTS}/{fonts.name}"]
    return [*command, "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/box", "--"]


@cache
def packages() -> list[str]:
    """The folders of the installed packages, which code in the box may import."""
    places = [path for package in (np, scipy) for path in package.__path__]
    return sorted({os.path.dirname(os.path.realpath(path)) for path in places})


def find_unused_user() -> int:
    """An unused user id: no account, no running process, no other box of this grader."""
    taken = {entry.pw_uid for entry in importlib.import_module("pwd").getpwall()}
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            taken.add(process.stat().st_uid)
    return next(user for user in USERS if user not in taken)
