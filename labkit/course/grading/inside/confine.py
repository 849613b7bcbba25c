"""What a process gives up before it runs a student's code: resources, its user, system calls."""

from __future__ import annotations

import ctypes
import errno
import os
import resource
import signal
import struct
import sys

MEBIBYTE = 1 << 20
SET_DEATH_SIGNAL, SET_NO_NEW_PRIVILEGES, SET_SECCOMP, FILTER = 1, 38, 22, 2
CLONE_THREAD = 0x00010000
ALLOW, KILL, FAIL = 0x7FFF0000, 0x80000000, 0x00050000
LOAD, EQUAL, AT_LEAST, ANY_BIT, RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
# Network, new programs, other processes, memory that outlives the process, doors into the kernel:
# socket, execve, execveat, fork, vfork, ptrace, process_vm_readv, process_vm_writev, setns,
# unshare, mount, bpf, perf_event_open, userfaultfd, add_key, request_key, keyctl, shmget, msgget,
# semget, mq_open, io_uring_setup. Then the name of the processor, clone and clone3.
REFUSED = {
    "x86_64": (41, 59, 322, 57, 58, 101, 310, 311, 308, 272, 165, 321, 298, 323, 248, 249, 250, 29,
               68, 64, 240, 425),
    "aarch64": (198, 221, 281, 117, 270, 271, 268, 97, 40, 280, 241, 282, 217, 218, 219, 194, 186,
                190, 180, 425),
}  # fmt: skip
PROCESSORS = {"x86_64": (0xC000003E, 56, 435), "aarch64": (0xC00000B7, 220, 435)}


def confine(*, seconds: float, memory: int, file_bytes: int, user: int, isolated: bool) -> None:
    """Give up what the student's code shall not have; for good.

    Parameters
    ----------
    seconds : float
        Processor time of the whole submission [s].
    memory : int
        Address space [bytes].
    file_bytes : int
        The largest file that can be written.
    user : int
        Whom to become; 0 to stay who one is.
    isolated : bool
        Whether system calls are filtered; without it there are limits alone.
    """
    limits = {
        resource.RLIMIT_CPU: int(seconds) + 1,
        resource.RLIMIT_AS: memory,
        resource.RLIMIT_FSIZE: file_bytes,
        resource.RLIMIT_NOFILE: 128,
        resource.RLIMIT_CORE: 0,
    }
    for kind, most in limits.items():
        if sys.platform == "linux" or kind != resource.RLIMIT_AS:  # macOS cannot limit it
            resource.setrlimit(kind, (most, most))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    if user:
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    if sys.platform == "linux":
        libc = ctypes.CDLL(None, use_errno=True)
        libc.prctl(SET_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
        if isolated:
            _filter(libc)


def _filter(libc: ctypes.CDLL) -> None:
    """Install the filter of system calls; raise where this system takes none."""
    machine = os.uname().machine
    if machine not in PROCESSORS:
        raise OSError(f"no filter of system calls for {machine}")
    program = _program(machine)
    buffer = ctypes.create_string_buffer(program)
    header = struct.pack("HxxxxxxP", len(program) // 8, ctypes.addressof(buffer))
    for arguments in ((SET_NO_NEW_PRIVILEGES, 1, 0, 0, 0), (SET_SECCOMP, FILTER, header, 0, 0)):
        if libc.prctl(*arguments):
            raise OSError(ctypes.get_errno(), "the system calls cannot be filtered")


def _program(machine: str) -> bytes:
    """The filter, in the instructions that the kernel takes."""
    architecture, clone, clone3 = PROCESSORS[machine]
    refused = FAIL | errno.EPERM

    def when(test: int, value: int, result: int) -> list[tuple[int, int, int, int]]:
        return [(test, 0, 1, value), (RETURN, 0, 0, result)]

    code = [(LOAD, 0, 0, 4), (EQUAL, 1, 0, architecture), (RETURN, 0, 0, KILL), (LOAD, 0, 0, 0)]
    if machine == "x86_64":
        code += when(AT_LEAST, 0x40000000, KILL)  # the calls of x32
    for number in REFUSED[machine]:
        code += when(EQUAL, number, refused)
    code += when(EQUAL, clone3, FAIL | errno.ENOSYS)  # libc then takes clone
    code += [(EQUAL, 1, 0, clone), (RETURN, 0, 0, ALLOW), (LOAD, 0, 0, 16)]
    code += [*when(ANY_BIT, CLONE_THREAD, ALLOW), (RETURN, 0, 0, refused)]
    return b"".join(struct.pack("HBBI", *one) for one in code)
