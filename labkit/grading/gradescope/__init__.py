"""The zip archive that makes an autograder of Gradescope's: scripts, labkit, hidden cases.

Its layout is Gradescope's [1]_: ``setup.sh`` builds the image, ``run_autograder`` grades one
submission in it.

References
----------
.. [1] Gradescope, "Autograder specifications".
"""

from __future__ import annotations

import os
import re
import zipfile
from importlib.metadata import requires
from pathlib import Path

from labkit.errors import LabkitError
from labkit.files import atomic_write
from labkit.grading.assignment import FOLDER, load_assignment

HERE = Path(__file__).parent
PACKAGE = HERE.parents[1]
SCRIPTS = ("setup.sh", "run_autograder")
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same content gives the same bytes


def write_autograder(
    path: str | os.PathLike[str], assignment: str | os.PathLike[str] = FOLDER
) -> None:
    """Write the archive to upload as "autograder" of a programming assignment.

    Parameters
    ----------
    path : path-like
        The zip archive.
    assignment : path-like
        The folder of the assignment, with its hidden cases.

    Raises
    ------
    LabkitError
        Where the archive cannot be written, or the folder holds no assignment to grade by.
    """
    load_assignment(assignment)
    folder = Path(assignment).resolve()
    with atomic_write(path, "wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zip:
        for name in SCRIPTS:
            _add(zip, name, (HERE / name).read_bytes(), executable=True)
        _add(zip, "requirements.txt", "\n".join(_requirements()).encode() + b"\n")
        for source in _package_files():
            _add(zip, f"labkit/{source.relative_to(PACKAGE).as_posix()}", source.read_bytes())
        for source in sorted(folder.rglob("*.json")):
            name = f"labkit/{FOLDER.relative_to(PACKAGE).as_posix()}"
            _add(zip, f"{name}/{source.relative_to(folder).as_posix()}", source.read_bytes())


def _package_files() -> list[Path]:
    """All of labkit but compiled files and the lab's own cases, which give way to the folder's."""
    return sorted(
        file
        for file in PACKAGE.rglob("*")
        if file.is_file()
        and "__pycache__" not in file.parts
        and not (FOLDER in file.parents and file.suffix == ".json")
    )


def _add(archive: zipfile.ZipFile, name: str, data: bytes, *, executable: bool = False) -> None:
    info = zipfile.ZipInfo(name, EPOCH)
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = (0o100755 if executable else 0o100644) << 16
    archive.writestr(info, data)


def _requirements() -> list[str]:
    """What labkit itself needs, without its optional extras."""
    declared = requires("labkit")
    if declared is None:
        raise LabkitError("labkit is not installed, so what it needs is not known; pip install it")
    return [line for line in declared if not re.search(r";.*extra\s*==", line)]
