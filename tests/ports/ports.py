"""The ports: what each needs, how it is built, and how it is started."""

from __future__ import annotations

import hashlib
import math
import os
import shutil
import subprocess
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
PORTS_FOLDER = REPOSITORY / "book" / "ports"

Find = Callable[[], str | None]
Build = Callable[[Path, Path], None]
Start = Callable[[Path, Path], list[str]]


class BuildError(RuntimeError):
    """A port that does not build; the message is the compiler's."""


@dataclass(frozen=True, kw_only=True)
class Port:
    """One language.

    Attributes
    ----------
    name : str
        Its folder under ``book/ports``.
    language : str
        Its name for people.
    install : str
        What to install where it cannot run.
    find : callable
        The program that it needs most, or None where something is missing.
    build : callable
        Builds (sources, out), or raises `BuildError`.
    start : callable
        The words that start what was built from (sources, out).
    most_distances : float
        Vectors whose runs take more distances than this are not asked of it.
    demo : tuple of str
        The arguments of the demo that it is asked for.
    """

    name: str
    language: str
    install: str
    find: Find
    build: Build
    start: Start
    most_distances: float = math.inf
    demo: tuple[str, ...] = ("7",)

    @property
    def sources(self) -> Path:
        """Where its files are."""
        return PORTS_FOLDER / self.name

    @property
    def missing(self) -> str | None:
        """What to install before it can run; None where it can."""
        return None if self.find() else f"{self.language} cannot run here: install {self.install}"


def execute(
    words: Sequence[str | Path], cwd: str | Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a program to its end, its output as text."""
    return subprocess.run(
        list(map(str, words)),
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        check=False,
    )


def _compile(words: Sequence[str | Path]) -> None:
    outcome = execute(words)
    if outcome.returncode or outcome.stderr:
        raise BuildError(f"{' '.join(map(str, words))}\n{outcome.stdout}{outcome.stderr}")


# ---------------------------------------------------------------- C++

_OPTIMISED = ("-O2",)
_SANITISED = ("-g1", "-fsanitize=address,undefined", "-fno-sanitize-recover")
_WARNINGS = ("-std=c++17", "-Wall", "-Wextra", "-Werror")


def _eigen() -> Path | None:
    told = execute(["pkg-config", "--variable=includedir", "eigen3"]) if _pkg_config() else None
    roots = [told.stdout.strip()] if told and told.stdout.strip() else []
    places = (Path(root) / "eigen3" for root in (*roots, "/usr/include", "/usr/local/include"))
    return next((place for place in places if (place / "Eigen" / "Dense").is_file()), None)


def _pkg_config() -> str | None:
    return shutil.which("pkg-config")


def _build_cpp(sources: Path, out: Path) -> None:
    """What ``g++ -O2 *.cpp -o icp2d`` does, file by file.

    An object is kept beside `out` under a name made from all that went into it, so that a
    copy with one file changed compiles that file alone.
    """
    flags = [*_WARNINGS, *_OPTIMISED, f"-I{_eigen()}"]
    headers = b"".join(file.read_bytes() for file in sorted(sources.glob("*.hpp")))
    objects = out.parent / "objects"
    objects.mkdir(exist_ok=True)

    def compiled(file: Path) -> Path:
        content = repr(flags).encode() + headers + file.read_bytes()
        kept = objects / f"{file.stem}-{hashlib.sha256(content).hexdigest()[:16]}.o"
        if not kept.exists():
            _compile(["g++", *flags, "-c", file, "-o", kept])
        return kept

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        linked = list(pool.map(compiled, sorted(sources.glob("*.cpp"))))
    _compile(["g++", *flags, *linked, "-o", out / "icp2d"])


def build_cpp_sanitised(sources: Path, out: Path) -> None:
    """The same program, which ends at an overflow, a stray index or a leak.

    All files are compiled as one: most of the time goes to reading Eigen's headers.
    """
    whole = out / "whole.cpp"
    whole.write_text("".join(f'#include "{file}"\n' for file in sorted(sources.glob("*.cpp"))))
    _compile(["g++", *_WARNINGS, *_SANITISED, f"-I{_eigen()}", whole, "-o", out / "icp2d"])


# ---------------------------------------------------------------- the others


def _build_java(sources: Path, out: Path) -> None:
    _compile(["javac", "-Xlint:all", "-Werror", "-d", out, *sorted(sources.glob("*.java"))])


def _octave() -> str | None:
    return shutil.which("octave-cli") or shutil.which("octave")


def mathics() -> str | None:
    """Mathics3: ``$MATHICS``, else that of ``.venv-wolfram``, else the one on the path."""
    own = REPOSITORY / ".venv-wolfram" / "bin" / "mathics"
    told = os.environ.get("MATHICS") or (str(own) if own.is_file() else "mathics")
    return shutil.which(told)


def _nothing_to_build(sources: Path, out: Path) -> None:
    pass


PORTS = (
    Port(
        name="cpp",
        language="C++",
        install="g++ and Eigen (Debian: g++ libeigen3-dev)",
        find=lambda: shutil.which("g++") if _eigen() else None,
        build=_build_cpp,
        start=lambda sources, out: [str(out / "icp2d")],
    ),
    Port(
        name="java",
        language="Java",
        install="a JDK, 17 or newer (Debian: default-jdk-headless)",
        find=lambda: shutil.which("javac"),
        build=_build_java,
        start=lambda sources, out: ["java", "-XX:+UseSerialGC", "-cp", str(out), "Icp2d"],
    ),
    Port(
        name="matlab",
        language="MATLAB",
        install="GNU Octave (Debian: octave)",
        find=_octave,
        build=_nothing_to_build,
        start=lambda sources, out: [
            str(_octave()),
            *("--quiet", "--no-init-file", "--path", str(sources)),
            str(sources / "icp2d_main.m"),
        ],
    ),
    Port(
        name="wolfram",
        language="Wolfram",
        install="Mathics3 in an environment of its own (tests/ports/requirements-wolfram.txt)",
        find=mathics,
        build=_nothing_to_build,
        start=lambda sources, out: [
            str(mathics()),
            *("--quiet", "-f", str(sources / "icp2d.wls")),
        ],
        most_distances=5_000,  # Mathics3 needs seconds for a thousand
        demo=("7", "6"),  # a smaller scene
    ),
)
