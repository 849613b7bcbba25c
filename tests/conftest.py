"""What the core's tests share: a hypothesis profile, and two scans with a known motion."""

import os
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import settings

from labkit import transform
from labkit.logs import Log, read_log
from labkit.simulation import Lidar, cast, room
from labkit.support.compiled import compiled_signatures
from tests.tools.installed import program

FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]  # of Chromium

# The same examples in every run: a red test stays red, and no clock decides. `make quick` draws
# a few of them. CI's nightly draws others, and more; pytest's --hypothesis-seed says which.
settings.register_profile("lab", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("quick", settings.get_profile("lab"), max_examples=20)
settings.register_profile("nightly", deadline=None, max_examples=500, print_blob=True)
settings.load_profile(os.environ.get("LABKIT_EXAMPLES", "lab"))


told_stages: set[str] = set()  # in this process


@pytest.hookimpl(trylast=True)  # once the test's fixtures are put away
def pytest_runtest_teardown() -> None:
    """The law: every stage is compiled for one kind of arguments, whatever a caller hands over.

    A second kind (an array that is writable, of another layout, of whole numbers) costs its caller
    seconds, in silence. The first test that compiles one fails.
    """
    signatures = compiled_signatures()
    several = {stage: kinds for stage, kinds in signatures.items() if len(kinds) > 1}
    new = several.keys() - told_stages
    told_stages.update(new)
    lines = [f"{stage}{kind}" for stage in sorted(new) for kind in several[stage]]
    assert not new, "compiled for a second kind of arguments:\n" + "\n".join(lines)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests come first, lest one worker wait for the other."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        return
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """One line on the tools that are missing here, and how to get them."""
    skipped = terminalreporter.stats.get("skipped", [])
    reasons = {str(report.longrepr[2]).removeprefix("Skipped: ") for report in skipped}
    if missing := sorted(reason for reason in reasons if "install" in reason):
        terminalreporter.write_line(f"Not tried here: {'; '.join(missing)}")


@pytest.fixture(scope="session")
def in_the_room() -> SimpleNamespace:
    """A noisy look at the room, and another after (0.1, 0.05) m and 3°: the scans and the truth."""
    T = transform(0.1, 0.05, np.radians(3.0))
    rng = np.random.default_rng(5)
    target, source = (cast(room(), pose, Lidar(), rng=rng) for pose in (np.eye(3), T))
    return SimpleNamespace(source=source, target=target, T_target_source=T)


@pytest.fixture(scope="session")
def killian() -> Log:
    """The built-in run; skips where rtb-data is not installed."""
    pytest.importorskip("rtbdata")
    return read_log("killian")


@pytest.fixture(scope="session")
def browser():
    """The machine's own Chromium: one for each process, which has one event loop."""
    api = pytest.importorskip("playwright.sync_api")
    from tests.book.widget_page import PATIENCE  # noqa: PLC0415 (imports playwright)

    path = program("chromium", "chromium", "chromium-browser", "google-chrome")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS, timeout=PATIENCE)
        yield browser
        browser.close()
