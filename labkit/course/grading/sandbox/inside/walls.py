"""What a process gives up before it runs a student's code: files, network, others, excess.

Every safe mode ends in the same two walls, an almost empty view of the file system and the
filter of `labkit.course.grading.sandbox.inside.syscall_filter`; the modes differ in how the first
one is built. The kernel calls that Python has no name for go by ctypes; each raises OSError.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import stat
import struct
import sys
from typing import Any

from labkit.course.grading.sandbox.inside import syscall_filter

if sys.platform == "linux":  # elsewhere no wall is built, but this file can be imported
    import resource

    LIBC = ctypes.CDLL(None, use_errno=True)

PRIVATE_FOLDER = "/tmp"
MAX_FILES = 256
OPEN_FILES = 32
NO_CORE = 1  # and 0 would let a program that collects core dumps have them


PR_SET_PDEATHSIG, PR_SET_SECCOMP, PR_CAPBSET_DROP = 1, 22, 24
PR_SET_NO_NEW_PRIVS, PR_CAP_AMBIENT = 38, 47
NEW_MOUNTS, NEW_IPC, NEW_PIDS = 0x00020000, 0x08000000, 0x20000000
NO_SUID, NO_DEVICES, NO_EXEC, BIND, RECURSIVE, PRIVATE = 2, 4, 8, 4096, 16384, 1 << 18
DETACH = 2
PIVOT_ROOT = {"x86_64": 155, "aarch64": 41}
LANDLOCK_CREATE, LANDLOCK_ADD, LANDLOCK_RESTRICT = 444, 445, 446


def confine(order: dict[str, Any]) -> None:
    """Close the jail around this process; there is no way back.

    Parameters
    ----------
    order : dict
        ``mode``; ``uid`` to change to, or None; ``folder``, the private one (modes without
        mounts); ``threads`` that may exist under this user; ``address_space`` [bytes] that
        Python and its libraries take; the `Limits` by name.

    Raises
    ------
    OSError
        If a wall cannot be built: then nothing may be run.
    """
    mode = order["mode"]
    if mode == "bubblewrap":
        empty_root(order["disk_bytes"], order["uid"])
    elif mode == "user":
        change_root(order["folder"], order["uid"])
    else:
        os.chdir(order["folder"])
    limit(order)
    if mode == "landlock":
        landlock(order["folder"])
    if order["uid"] is not None:
        os.setgroups([])
        os.setresgid(order["uid"], order["uid"], order["uid"])
        os.setresuid(order["uid"], order["uid"], order["uid"])
    if os.geteuid() == 0 or mode == "bubblewrap":
        drop_capabilities()
    prctl(PR_SET_PDEATHSIG, signal.SIGKILL, "die with the supervisor")
    seccomp(syscall_filter.program(os.uname().machine, os.getpid(), mode != "landlock"))


def empty_root(size: int, uid: int | None) -> None:
    """Live in a small file system of one's own that holds nothing but /dev/null and /tmp."""
    unshare(NEW_MOUNTS | NEW_IPC)
    mount(None, b"/", None, RECURSIVE | PRIVATE, None)
    options = f"size={size},nr_inodes={MAX_FILES},mode=0755".encode()
    harmless = NO_SUID | NO_EXEC
    mount(b"tmpfs", PRIVATE_FOLDER.encode(), b"tmpfs", harmless | NO_DEVICES, options)
    os.chdir(PRIVATE_FOLDER)
    os.mkdir("dev")
    for name in ("null", "zero", "urandom"):
        with open(f"dev/{name}", "wb"):
            pass
        device = f"/dev/{name}".encode()
        mount(device, b"." + device, None, BIND, None)
    os.mkdir("tmp")
    if uid is not None:
        os.chown("tmp", uid, uid)
    pivot_root_here()
    os.chdir("/tmp")


def change_root(folder: str, uid: int) -> None:
    """Live in a folder that holds nothing but /dev/null and a /tmp of one's own."""
    os.chdir(folder)
    os.chmod(".", 0o755)
    os.mkdir("dev")
    with contextlib.suppress(OSError):  # some containers make no devices
        os.mknod("dev/null", stat.S_IFCHR, os.makedev(1, 3))
        os.chmod("dev/null", 0o666)
    os.mkdir("tmp")
    os.chown("tmp", uid, uid)
    os.chroot(".")
    os.chdir(PRIVATE_FOLDER)


def limit(order: dict[str, Any]) -> None:
    """Lower the limits that the kernel keeps for each process."""
    for what, most in {
        resource.RLIMIT_CPU: int(order["total_seconds"]) + 2,
        resource.RLIMIT_AS: order["address_space"] + order["memory"],
        resource.RLIMIT_FSIZE: order["file_bytes"],
        resource.RLIMIT_NPROC: order["threads"],
        resource.RLIMIT_NOFILE: OPEN_FILES,
        resource.RLIMIT_CORE: NO_CORE,
        resource.RLIMIT_MEMLOCK: 0,
        resource.RLIMIT_MSGQUEUE: 0,
    }.items():
        _, hard = resource.getrlimit(what)
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (least, least))


def check(result: int, what: str) -> int:
    """Return what a call returned, or raise its errno with a word on what was tried."""
    if result < 0:
        error = ctypes.get_errno()
        raise OSError(error, f"{what}: {os.strerror(error)}")
    return result


def prctl(option: int, value: int, what: str) -> None:
    """Set one property of this process."""
    check(LIBC.prctl(option, value, 0, 0, 0), what)


def unshare(flags: int) -> None:
    """Leave the namespaces named by `flags`."""
    check(LIBC.unshare(flags), "unshare")


def return_to(process: int, flags: int) -> None:
    """Enter the namespaces of a process, given by its pidfd."""
    check(LIBC.setns(process, flags), "setns")


def mount(
    source: bytes | None, target: bytes, kind: bytes | None, flags: int, options: bytes | None
) -> None:
    """Put a file system, or a part of one, in a place."""
    check(LIBC.mount(source, target, kind, flags, options), f"mount {target.decode()}")


def pivot_root_here() -> None:
    """Make the current directory, a mount point, the root, and let go of the old one."""
    number = PIVOT_ROOT[os.uname().machine]
    check(LIBC.syscall(number, b".", b"."), "pivot_root")
    check(LIBC.umount2(b".", DETACH), "umount the old root")
    os.chdir("/")


def drop_capabilities() -> None:
    """Give up all capabilities, also those that an exec could bring back."""
    for capability in range(64):
        LIBC.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)  # EINVAL past the last one
    LIBC.prctl(PR_CAP_AMBIENT, 4, 0, 0, 0)
    head = struct.pack("<Ii", 0x20080522, 0)  # version 3, this process
    check(LIBC.capset(head, bytes(24)), "capset")


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("filter", ctypes.c_void_p))


def seccomp(program: bytes) -> None:
    """Filter this process's system calls from now on, for good."""
    code = ctypes.create_string_buffer(program, len(program))
    holder = _Program(len(program) // 8, ctypes.cast(code, ctypes.c_void_p))
    prctl(PR_SET_NO_NEW_PRIVS, 1, "no_new_privs")
    check(LIBC.prctl(PR_SET_SECCOMP, 2, ctypes.byref(holder), 0, 0), "seccomp")


def landlock_version() -> int:
    """The kernel's Landlock ABI, 0 where it has none."""
    return max(0, int(LIBC.syscall(LANDLOCK_CREATE, None, 0, 1)))


def landlock(folder: str) -> None:
    """Deny all files but those in `folder` (flat) and the harmless devices.

    Rights are those of linux/landlock.h: handled are all that the running kernel knows,
    and from version 4 on TCP, from 6 on abstract sockets and signals.
    """
    version = landlock_version()
    if version < 1:
        raise OSError("this kernel has no Landlock")
    handled = (1 << 13) - 1  # execute, write, read, read_dir, remove_*, make_*
    for since, bit in ((2, 13), (3, 14), (5, 15)):  # refer, truncate, ioctl on devices
        handled |= (1 << bit) * (version >= since)
    network = 0b11 * (version >= 4)
    scoped = 0b11 * (version >= 6)
    size = 8 if version < 4 else 16 if version < 6 else 24
    rules = struct.pack("<QQQ", handled, network, scoped)
    ruleset = check(LIBC.syscall(LANDLOCK_CREATE, rules, size, 0), "landlock_create_ruleset")
    write, read, read_folder, remove, make, truncate = (1 << bit for bit in (1, 2, 3, 5, 8, 14))
    use = (write | read | truncate) & handled
    for path, rights in (
        (folder, (use | read_folder | remove | make) & handled),
        ("/dev/null", use),
        ("/dev/zero", read),
        ("/dev/urandom", read),
    ):
        beneath = os.open(path, os.O_PATH | os.O_CLOEXEC)
        rule = struct.pack("<Qi", rights, beneath)
        check(LIBC.syscall(LANDLOCK_ADD, ruleset, 1, rule, 0), f"landlock_add_rule {path}")
        os.close(beneath)
    prctl(PR_SET_NO_NEW_PRIVS, 1, "no_new_privs")
    check(LIBC.syscall(LANDLOCK_RESTRICT, ruleset, 0), "landlock_restrict_self")
    os.close(ruleset)
