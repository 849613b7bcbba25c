"""The few kernel calls that Python has no name for, by ctypes; each raises OSError."""

from __future__ import annotations

import ctypes
import os
import struct

LIBC = ctypes.CDLL(None, use_errno=True)

PR_SET_PDEATHSIG, PR_SET_SECCOMP, PR_CAPBSET_DROP = 1, 22, 24
PR_SET_NO_NEW_PRIVS, PR_CAP_AMBIENT = 38, 47
NEW_MOUNTS, NEW_IPC, NEW_PIDS = 0x00020000, 0x08000000, 0x20000000
NO_SUID, NO_DEVICES, NO_EXEC, BIND, RECURSIVE, PRIVATE = 2, 4, 8, 4096, 16384, 1 << 18
DETACH = 2
PIVOT_ROOT = {"x86_64": 155, "aarch64": 41}
LANDLOCK_CREATE, LANDLOCK_ADD, LANDLOCK_RESTRICT = 444, 445, 446


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
