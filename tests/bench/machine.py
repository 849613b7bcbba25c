"""Where and with what the bench ran: enough to repeat it, nothing that names the place."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import labkit

PACKAGES = (
    "numpy",
    "scipy",
    "open3d",
    "small-gicp",
    "kiss-icp",
    "fricp-cpp",
    "simpleicp",
    "karto-scanmatcher",
)
CPU_INFO = Path("/proc/cpuinfo")


def describe_machine() -> dict[str, str | int]:
    """The processor, how many of its cores there were, and the system."""
    return {
        "cpu": _cpu_model(),
        "cores": os.cpu_count() or 1,
        "system": f"{platform.system()} {platform.machine()}",
    }


def describe_versions() -> dict[str, str]:
    """Python, labkit with its commit, and every package that took part."""
    versions = {"python": platform.python_version(), "labkit": _labkit_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    mrpt = _output("dpkg-query", "--show", "--showformat=${Version}", "libmrpt-slam-dev")
    return versions | ({"mrpt": mrpt} if mrpt else {})


def today() -> str:
    """The date, as YYYY-MM-DD (UTC)."""
    return datetime.now(UTC).date().isoformat()


def _cpu_model() -> str:
    if CPU_INFO.exists():
        for line in CPU_INFO.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"


def _labkit_version() -> str:
    """With the last commit that changed it: later ones leave what was measured as it is."""
    package = Path(labkit.__file__).parent
    commit = _output("git", "-C", str(package), "log", "-1", "--format=%h", "--", ".")
    dirty = "-dirty" if _output("git", "-C", str(package), "status", "--porcelain", ".") else ""
    return f"{labkit.__version__} ({commit}{dirty})" if commit else labkit.__version__


def _output(*command: str) -> str:
    """What a program prints; nothing where it is not installed or has nothing to say."""
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
    except OSError:
        return ""
