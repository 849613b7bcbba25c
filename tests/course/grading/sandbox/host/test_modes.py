"""The choice of a mode: what is tried, what is said, and that a wall with a hole is found."""

import shutil
import sys

import pytest

from labkit.course.grading.contract import Call, Limits, OutcomeStatus, SourceCell
from labkit.course.grading.sandbox.host import (
    MODES,
    SAFE,
    SandboxError,
    available_modes,
    modes,
    open_sandbox,
)
from labkit.course.grading.sandbox.host.modes import WALL_TEST, holes
from labkit.errors import InvalidParameterError

CELL = SourceCell(source="def f(x):\n    return 2 * x", question="q", label="cell 1")
CALL = Call(id="1", question="q", function="f", arguments=(21,))


def refuse(names):
    """A Sandbox that opens in no mode of `names`."""
    real = modes.Sandbox

    def slot(mode, limits):
        if mode in names:
            raise SandboxError(f"mode {mode} does not work here: it is broken")
        return real(mode, limits)

    return slot


def test_every_mode_is_named_and_says_whether_it_works():
    found = available_modes()
    assert tuple(found) == MODES
    assert found["none"] == ""
    assert all("does not work here" not in why for why in found.values())


def test_auto_takes_the_strongest_that_works(monkeypatch):
    working = [mode for mode in SAFE if not available_modes()[mode]]
    for place, mode in enumerate(working):
        monkeypatch.setattr(modes, "Sandbox", refuse(working[:place]))
        with open_sandbox() as slot:
            assert slot.mode == mode


def test_auto_never_falls_back_to_none(monkeypatch):
    monkeypatch.setattr(modes, "Sandbox", refuse(SAFE))
    monkeypatch.setattr(modes, "obstacle", lambda mode: "")
    modes._tried.cache_clear()
    with pytest.raises(SandboxError, match="no safe mode") as caught:
        open_sandbox()
    modes._tried.cache_clear()
    for mode in SAFE:
        assert f"{mode}: it is broken" in str(caught.value)
    assert "--no-isolation" in str(caught.value)


def test_an_unknown_mode_is_named():
    with pytest.raises(InvalidParameterError, match="bubblewrap, landlock, user, none, got 'jail'"):
        open_sandbox("jail")


def test_without_bubblewrap_it_says_what_to_install(monkeypatch):
    if sys.platform != "linux":
        pytest.skip("there is no bubblewrap but on Linux")
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(SandboxError, match="apt-get install bubblewrap"):
        open_sandbox("bubblewrap")


def test_other_systems_have_none_alone(monkeypatch):
    monkeypatch.setattr(sys, "platform", "darwin")
    for mode in SAFE:
        with pytest.raises(SandboxError, match=f"mode {mode} .*needs Linux, and this is darwin"):
            open_sandbox(mode)


@pytest.mark.skipif(sys.platform != "linux", reason="there is no such mode but on Linux")
def test_another_user_needs_root(monkeypatch):
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    with pytest.raises(SandboxError, match="only root can become another user"):
        open_sandbox("user")


def test_the_wall_test_finds_the_holes_of_no_wall():
    """What proves the safe modes fails where there is nothing to prove."""
    cell = SourceCell(source=WALL_TEST, question=None, label="the wall test")
    call = Call(id="wall", question="wall", function="holes", arguments=(__file__, 1))
    with open_sandbox("none") as slot:
        (outcome,) = slot.run([cell], [call])
    assert {
        "it can read the grader's files",
        "it can open a socket",
        "it can start a process",
        "it can change metadata",
        "it can list the root directory",
        "it can set record locks that others see",
        "it can set file locks that others see",
        "it can see which processes live",
    } <= set(outcome.value)
    assert "it can start a process" in holes(outcome)


def test_a_mode_that_does_not_hold_is_not_opened(monkeypatch, slot):
    leaky = WALL_TEST.replace("def refused(attempt):", "def refused(attempt):\n    return False")
    monkeypatch.setattr(modes, "WALL_TEST", leaky)
    with pytest.raises(SandboxError, match="does not isolate here: it can read the grader"):
        modes.Sandbox(slot.mode, Limits())


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("seconds", 0.0, r"`seconds` must be in \(0, 3600\] s, got 0.0"),
        ("total_seconds", -1.0, "`total_seconds` must be in"),
        ("memory", 1000, "`memory` must be a whole number of at least 67108864, got 1000"),
        ("threads", 0, "`threads` must be a whole number of at least 1, got 0"),
        ("disk_bytes", 0, "`disk_bytes` must be a whole number"),
        ("result_bytes", 3.5, "`result_bytes` must be a whole number"),
    ],
)
def test_limits_are_checked(name, value, message):
    with pytest.raises(InvalidParameterError, match=message):
        Limits(**{name: value})


def test_every_status_says_itself():
    for status in OutcomeStatus:
        assert status.value.islower()
