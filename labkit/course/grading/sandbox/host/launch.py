"""How a Python that knows only the box is started: command line, environment, folders, user.

In mode "bubblewrap" the zygote runs in namespaces of its own, each submission in further ones.
The zygote sees Python, its libraries and the box, read-only, and no network. It keeps the right
to mount within its namespaces, so that it can give each child an empty root; the child gives up
that right before it runs a student's code.

Where root grades, boxes run as unprivileged users: one a slot, nobody's account, never shared.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from labkit.course.grading import extraction
from labkit.course.grading.sandbox import inside
from labkit.course.grading.sandbox.host.box import SandboxError

BOX = Path(inside.__file__).parent
READER = Path(extraction.__file__).parent
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

# Makes `sandbox.inside` and `extraction` of the grading importable and nothing else of labkit,
# then runs a main of the first.
# No package's start-up hooks run (-S), which take longer than the interpreter itself; but
# `exit`, `help` and the like are there.
BOOTSTRAP = """
import os, site, sys, types
site.setquit(), site.setcopyright(), site.sethelper()
box, reader, roots, module, argument = sys.argv[1:]
for name, path in (("", []), (".course", []), (".course.grading", []),
                   (".course.grading.sandbox", []), (".course.grading.extraction", [reader]),
                   (".course.grading.sandbox.inside", [box])):
    package = f"labkit{name}"
    sys.modules[package] = types.ModuleType(package)
    sys.modules[package].__path__ = path
sys.path += [root for root in roots.split(os.pathsep) if root not in sys.path]
main = __import__(f"{package}.{module}", fromlist=["main"]).main
main(int(argument) if argument.isdigit() else argument)
"""


def command(module: str, argument: str) -> list[str]:
    """The command line that runs ``sandbox.inside.<module>.main(argument)`` of the grading."""
    roots = os.pathsep.join(map(str, package_roots()))
    return [
        sys.executable,
        "-S",
        "-s",
        "-P",
        "-B",
        "-c",
        BOOTSTRAP,
        str(BOX),
        str(READER),
        roots,
        module,
        argument,
    ]


def environment() -> dict[str, str]:
    """All that a box learns from the environment: nothing of the grader's own."""
    given = ONE_THREAD | {
        "PATH": "/usr/bin:/bin",
        "HOME": "/tmp",
        "LANG": "C.UTF-8",
        "PYTHONHASHSEED": "0",  # the same verdict whenever a submission is graded
    }
    if sys.platform == "win32":
        given |= {name: os.environ[name] for name in ("SYSTEMROOT",) if name in os.environ}
    return given


def package_roots() -> list[Path]:
    """The folders that hold numpy and, where it is installed, scipy."""
    roots: list[Path] = []
    for name in ("numpy", "scipy"):
        spec = find_spec(name)
        if spec and spec.origin:
            root = Path(spec.origin).parent.parent
            if root not in roots:
                roots.append(root)
    return roots


HOLDER = """
import ctypes, sys
libc = ctypes.CDLL(None, use_errno=True)
print(ctypes.get_errno() if libc.unshare(0x10000000) else 0, flush=True)
sys.stdin.read()
"""  # leaves for a new user namespace, and stays until it is mapped
DEVICES = ("/dev/null", "/dev/zero", "/dev/urandom")
SYSTEM = ("/usr", "/lib", "/lib32", "/lib64", "/libx32", "/bin", "/sbin", "/nix/store")
CAPABILITIES = ("SYS_ADMIN", "SETUID", "SETGID", "SETPCAP", "CHOWN", "KILL")


def bubblewrap(users: int | None) -> list[str]:
    """What to put before the zygote's command line.

    Parameters
    ----------
    users : int or None
        A file descriptor of a user namespace (`mapped_users`); None lets bubblewrap make
        one, in which the sandbox's only user is the grader's own.
    """
    program = shutil.which("bwrap")
    if program is None:
        raise SandboxError("bubblewrap is not installed; `apt-get install bubblewrap`")
    whose = ["--unshare-user"] if users is None else ["--userns", str(users)]
    words = [program, *whose, "--unshare-ipc", "--unshare-pid", "--unshare-net"]
    words += ["--unshare-uts", "--unshare-cgroup-try", "--new-session"]
    for name in CAPABILITIES:
        words += ["--cap-add", f"CAP_{name}"]
    for path in map(Path, SYSTEM):
        if path.is_symlink():
            words += ["--symlink", os.readlink(path), str(path)]
        elif path.exists():
            words += ["--ro-bind", str(path), str(path)]
    for folder in interpreter_folders():
        words += ["--ro-bind", str(folder), str(folder)]
    for device in DEVICES:
        words += ["--dev-bind", device, device]
    return [*words, "--dir", "/tmp", "--remount-ro", "/", "--chdir", "/"]


def interpreter_folders() -> list[Path]:
    """The folders outside the system's own that this Python and its packages live in."""
    folders = [Path(sys.prefix), Path(sys.base_prefix), *package_roots(), BOX, READER]
    kept: list[Path] = []
    for folder in sorted({path.resolve() for path in folders} | {Path(sys.prefix)}):
        if not any(folder.is_relative_to(above) for above in [*kept, *map(Path, SYSTEM)]):
            kept.append(folder)
    return kept


def mapped_users(uid: int) -> int:
    """Make, as root, a user namespace that has root and the slot's user; a file descriptor.

    Without it a student's code would run as the machine's root, if without its rights, and
    no limit on threads would hold, since the kernel counts none for root.
    """
    command = [sys.executable, "-I", "-S", "-c", HOLDER]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdin is not None
        assert holder.stdout is not None
        answer = holder.stdout.readline().decode().strip()
        if answer != "0":
            raise SandboxError(f"this machine refuses user namespaces (error {answer})")
        for kind in ("uid_map", "gid_map"):
            Path(f"/proc/{holder.pid}/{kind}").write_text(f"0 0 1\n{uid} {uid} 1\n", "ascii")
        namespace = os.open(f"/proc/{holder.pid}/ns/user", os.O_RDONLY)
        holder.stdin.close()  # the holder leaves; the descriptor keeps the namespace
        return namespace


FIRST, COUNT = 64_000, 1_000  # user ids


class SlotUser:
    """A user id that no other slot on this machine has while this object is open.

    The lock is an abstract socket: the kernel frees it whichever way the grader ends.
    """

    def __init__(self) -> None:
        for self.uid in range(FIRST, FIRST + COUNT):
            self.lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                self.lock.bind(f"\0labkit-grading-user-{self.uid}")
            except OSError:
                self.lock.close()
            else:
                return
        raise SandboxError(f"all {COUNT} user ids from {FIRST} on are in use by other graders")

    def close(self) -> None:
        """End whatever still runs as this user, and free the id."""
        for pid in processes_of(self.uid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.lock.close()


def processes_of(uid: int) -> list[int]:
    """The processes that run as a user, as far as /proc tells."""
    found = []
    for folder in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if folder.name.isdigit() and folder.stat().st_uid == uid:
                found.append(int(folder.name))
    return found


def threads_of(uid: int) -> int:
    """How many threads run as a user: what RLIMIT_NPROC counts."""
    return sum(
        len(os.listdir(task))
        for task in (f"/proc/{pid}/task" for pid in processes_of(uid))
        if os.path.isdir(task)
    )
