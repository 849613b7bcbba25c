"""A seccomp filter as classic BPF, assembled for this machine and this process.

The program reads the number of a system call, compares it with one rule after the other
and returns "allow" or an error number; a call without a rule gets EPERM. Offsets are those
of ``struct seccomp_data`` (linux/seccomp.h): number, architecture, then six arguments of
eight bytes, low half first on both machines.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Sequence
from typing import NamedTuple

from labkit.grading.box.syscalls import (
    CONDITIONAL,
    ENOENT,
    ENOSYS,
    FREE,
    MACHINES,
    PATHS,
    Machine,
)

LOAD, AND, JUMP_IF_EQUAL, RETURN = 0x20, 0x54, 0x15, 0x06
ALLOW, REFUSE, KILL = 0x7FFF0000, 0x00050000, 0x80000000
EPERM = 1
NUMBER, ARCHITECTURE = 0, 4
WHOLE = 0xFFFFFFFF
ONESELF = 0xA5C3960F  # no process has this number, no rule this value

# A thread has the process's descriptors: what it holds open is counted with theirs.
CLONE_THREAD, CLONE_NEW_ANY = 0x00010400, 0x7E020080
ANONYMOUS = 0x20  # a mapped file would stay on the disk, removed, closed and uncounted
CLOSE_ON_EXEC = 4  # for close_range; not: a table of descriptors of its own
AT_EMPTY_PATH = 0x1000
# Terminal size and kind, bytes waiting, close-on-exec, non-blocking; not: owner and signal.
IOCTLS = (0x5401, 0x5413, 0x541B, 0x5421, 0x5450, 0x5451)
# Duplicate, flags, record locks; not F_SETOWN and F_SETSIG, which send signals to others.
FCNTLS = (0, 1, 2, 3, 4, 5, 6, 7, 1030)
# Names of threads and of memory areas.
PRCTLS = (15, 16, 0x53564D41)

Instruction = tuple[int, int, int, int]


class Condition(NamedTuple):
    """The low (or high) half of an argument, masked, must be one of `values`."""

    argument: int
    values: Sequence[int]
    mask: int = WHOLE
    high: bool = False


def program(machine: str, pid: int, own_root: bool) -> bytes:
    """Give the filter; assembled once, and then only signed with the process's number.

    Parameters
    ----------
    machine : str
        As `os.uname` names it; a key of `MACHINES`.
    pid : int
        The process that may signal itself, as it sees its own number.
    own_root : bool
        Whether the jail has a root directory of its own. Without one, questions about a
        path ("does it exist?") answer ENOENT, since Landlock does not hold them back.

    Returns
    -------
    bytes
        Instructions of eight bytes each.

    Raises
    ------
    KeyError
        If the machine is not known.
    """
    return assembled(machine, own_root).replace(struct.pack("<I", ONESELF), struct.pack("<I", pid))


@functools.cache
def assembled(machine: str, own_root: bool) -> bytes:
    """Assemble the filter with `ONESELF` in the place of the process's number."""
    here = MACHINES[machine]
    code: list[Instruction] = [
        (LOAD, 0, 0, ARCHITECTURE),
        (JUMP_IF_EQUAL, 1, 0, here.audit),
        (RETURN, 0, 0, KILL),
        (LOAD, 0, 0, NUMBER),
    ]
    for name in FREE:
        code += rule(here, FREE[name])
    for name in PATHS:
        if own_root:
            code += rule(here, PATHS[name])
        elif name in ("newfstatat", "statx"):
            flags = 3 if name == "newfstatat" else 2
            empty = Condition(flags, (AT_EMPTY_PATH,), mask=AT_EMPTY_PATH)
            code += rule(here, PATHS[name], empty, otherwise=ENOENT)
        else:
            code += rule(here, PATHS[name], answer=REFUSE | ENOENT)
    thread = Condition(0, (CLONE_THREAD,), mask=CLONE_THREAD | CLONE_NEW_ANY)
    oneself = Condition(0, (ONESELF,))
    asks = (Condition(0, (0, ONESELF)), Condition(2, (0,)), Condition(2, (0,), high=True))
    code += rule(here, CONDITIONAL["clone"], thread)
    code += rule(here, CONDITIONAL["clone3"], answer=REFUSE | ENOSYS)
    code += rule(here, CONDITIONAL["kill"], oneself)
    code += rule(here, CONDITIONAL["tgkill"], oneself)
    code += rule(here, CONDITIONAL["prlimit64"], *asks)
    code += rule(here, CONDITIONAL["fcntl"], Condition(1, FCNTLS))
    code += rule(here, CONDITIONAL["ioctl"], Condition(1, IOCTLS))
    code += rule(here, CONDITIONAL["prctl"], Condition(0, PRCTLS))
    code += rule(here, CONDITIONAL["mmap"], Condition(3, (ANONYMOUS,), mask=ANONYMOUS))
    code += rule(here, CONDITIONAL["close_range"], Condition(2, (0, CLOSE_ON_EXEC)))
    code.append((RETURN, 0, 0, REFUSE | EPERM))
    return b"".join(struct.pack("<HBBI", *instruction) for instruction in code)


def rule(
    machine: Machine,
    numbers: tuple[int, int],
    *conditions: Condition,
    answer: int = ALLOW,
    otherwise: int = EPERM,
) -> list[Instruction]:
    """If the call is this one: `answer` where all conditions hold, `otherwise` where not."""
    number = numbers[machine.column]
    if number < 0:
        return []
    body: list[Instruction] = []
    for condition in conditions:
        body.append((LOAD, 0, 0, 16 + 8 * condition.argument + 4 * condition.high))
        body.append((AND, 0, 0, condition.mask))
        for place, value in enumerate(condition.values):
            skip = len(condition.values) - place
            body.append((JUMP_IF_EQUAL, skip, 0, value))
        body.append((RETURN, 0, 0, REFUSE | otherwise))
    body.append((RETURN, 0, 0, answer))
    return [(JUMP_IF_EQUAL, 0, len(body), number), *body]
