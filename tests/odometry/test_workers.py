"""Work spread over processes: order, errors, bounds, and nobody left behind."""

import multiprocessing
import operator
import threading
import time

import pytest

from labkit.errors import LabkitError
from labkit.odometry import available_cores, workers
from labkit.odometry.workers import AHEAD, in_order

TASKS = [(number, 7) for number in range(40)]
QUOTIENTS = [number // 7 for number in range(40)]


@pytest.fixture(params=["safest", "spawn"])
def method(request, monkeypatch):
    """Workers as they start here, and as they do on Windows and macOS."""
    if request.param == "spawn":
        monkeypatch.setattr(workers, "start_method", lambda: "spawn")


@pytest.mark.parametrize("count", [0, 1, 2])
@pytest.mark.usefixtures("method")
def test_results_come_in_the_order_of_the_tasks(count):
    assert list(in_order(operator.floordiv, iter(TASKS), count)) == QUOTIENTS
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("count", [0, 1])
def test_no_tasks_no_results(count):
    assert list(in_order(operator.floordiv, [], count)) == []


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.usefixtures("method")
def test_an_error_is_raised_here_after_the_results_before_it(count):
    """The first tasks go to the worker, so that the error has to travel."""
    results = in_order(operator.floordiv, [(7, 7), (1, 0), *TASKS], count)
    assert next(results) == 1
    with pytest.raises(ZeroDivisionError, match="integer division or modulo by zero"):
        list(results)
    assert not multiprocessing.active_children()


def test_few_tasks_are_under_way(monkeypatch):
    """At no time does a worker hold more than `AHEAD`, and the rest stays where it was."""
    handed = []
    submit = workers._submit

    def watched(*arguments):
        handed.append(submit(*arguments))
        under_way = sum(not future.done() for future in handed)
        assert under_way <= AHEAD
        return handed[-1]

    monkeypatch.setattr(workers, "_submit", watched)
    assert len(list(in_order(time.sleep, [(0.01,)] * 30, 1))) == 30
    assert AHEAD <= len(handed) < 30  # this process did some itself


def test_a_caller_that_has_seen_enough_leaves_no_process():
    results = in_order(operator.floordiv, iter(TASKS), 1)
    assert next(results) == 0
    assert multiprocessing.active_children()
    results.close()
    assert not multiprocessing.active_children()


def test_a_worker_that_is_killed_is_missed():
    results = in_order(time.sleep, [(0.05,)] * 100, 1)
    next(results)
    for child in multiprocessing.active_children():
        child.kill()
    with pytest.raises(LabkitError, match=r"was ended \(.*\); do it in one process: jobs=1"):
        list(results)


def test_workers_that_cannot_start_are_said_to(monkeypatch):
    def refuse(*_, **__):
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(workers, "ProcessPoolExecutor", refuse)
    with pytest.raises(LabkitError, match=r"did not start, .*temporarily unavailable"):
        list(in_order(operator.floordiv, TASKS, 1))


def test_workers_are_copies_only_where_that_is_safe(monkeypatch):
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    for platform, method in (("linux", "fork"), ("darwin", "spawn"), ("win32", "spawn")):
        monkeypatch.setattr(workers.sys, "platform", platform)
        assert workers.start_method() == method
    monkeypatch.setattr(workers.sys, "platform", "linux")
    monkeypatch.setattr(threading, "active_count", lambda: 2)
    assert workers.start_method() == "spawn"


def test_there_is_a_core():
    assert 1 <= available_cores() <= multiprocessing.cpu_count()
