"""Confine a process before it runs a student's code: resources, its user, system calls."""

from __future__ import annotations

import ctypes
import errno
import os
import resource
import signal
import struct
import sys

ALLOW, FAIL, MASKED_EQUAL, CLONE_THREAD = 0x7FFF0000, 0x00050000, 7, 0x00010000
# Network, new programs, other processes, memory that outlives the process, doors into the kernel.
REFUSED = """
    socket execve execveat fork vfork ptrace process_vm_readv process_vm_writev setns unshare mount
    bpf perf_event_open userfaultfd add_key request_key keyctl shmget msgget semget mq_open
    io_uring_setup
"""


def confine(*, seconds: float, memory: int, file_bytes: int, user: int, isolated: bool) -> None:
    """Give up what the student's code shall not have; for good.

    That is more than so many seconds of processor time, and bytes of address space and of a file;
    the user that one is, unless `user` is 0; and, where it is `isolated`, many system calls.
    """
    limits = {"CPU": int(seconds) + 1, "FSIZE": file_bytes, "NOFILE": 128, "CORE": 0, "AS": memory}
    for kind, most in limits.items():
        if kind != "AS" or sys.platform == "linux":  # macOS cannot limit it
            resource.setrlimit(getattr(resource, f"RLIMIT_{kind}"), (most, most))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    if user:
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL, 0, 0, 0)  # it dies when the grader does
    if isolated:
        _refuse(ctypes.CDLL("libseccomp.so.2"))


def _refuse(library: ctypes.CDLL) -> None:
    """Have system calls refused; raise where this system does not take the filter."""
    library.seccomp_init.restype = ctypes.c_void_p
    rules = ctypes.c_void_p(library.seccomp_init(ALLOW))
    no_thread = struct.pack("IiQQ", 0, MASKED_EQUAL, CLONE_THREAD, 0)  # of argument 0
    calls = [(name, errno.EPERM, 0) for name in REFUSED.split()]
    calls += [("clone", errno.EPERM, 1), ("clone3", errno.ENOSYS, 0)]  # libc then takes clone
    for name, error, conditions in calls:
        number = library.seccomp_syscall_resolve_name(name.encode())
        if number < -1:  # this processor has no such call
            continue
        if library.seccomp_rule_add_array(rules, FAIL | error, number, conditions, no_thread):
            raise OSError(errno.ENOSYS, f"libseccomp cannot refuse {name}")
    if library.seccomp_load(rules):
        raise OSError(errno.ENOSYS, "this system filters no system calls")
