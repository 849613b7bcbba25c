"""How a Python that knows only the box is started: command line, environment, folders."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from labkit.grading import box

BOX = Path(box.__file__).parent
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

# Makes `labkit.grading.box` importable and nothing else of labkit, then runs one of its mains.
# No package's start-up hooks run (-S), which take longer than the interpreter itself; but
# `exit`, `help` and the like are there.
BOOTSTRAP = """
import os, site, sys, types
site.setquit(), site.setcopyright(), site.sethelper()
folder, roots, module, argument = sys.argv[1:]
for name, path in (("labkit", []), ("labkit.grading", []), ("labkit.grading.box", [folder])):
    sys.modules[name] = package = types.ModuleType(name)
    package.__path__ = path
sys.path += [root for root in roots.split(os.pathsep) if root not in sys.path]
main = __import__("labkit.grading.box." + module, fromlist=["main"]).main
main(int(argument) if argument.isdigit() else argument)
"""


def command(module: str, argument: str) -> list[str]:
    """The command line that runs ``labkit.grading.box.<module>.main(argument)``."""
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
