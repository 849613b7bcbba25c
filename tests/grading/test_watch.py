"""Law 1: no clock decides a mark. The watch counts what the code did, and not how long it took."""

import random
from itertools import accumulate

import pytest

from labkit.grading.box.inside.limits import MAX_THREADS
from labkit.grading.box.watch import (
    BUSY,
    LOOK,
    MAX_IDLE,
    BoxError,
    BoxTimeout,
    MachineError,
    Usage,
    Watch,
)

ALLOWED = 2.0


def watch_for(seconds, *, work=0.0, wait=0.0, at_disk=False, gaps=()):
    """Look all the while; `work` and `wait` are shares of the clock, `gaps` stop the grader."""
    steps = [LOOK] * round(seconds / LOOK)
    for place, gap in gaps:
        steps[place % len(steps)] += gap
    watch = Watch(ALLOWED, Usage(0.0), now=0.0)
    running = 0.0
    for now, step in zip(accumulate(steps), steps, strict=True):
        running += min(step, LOOK)
        watch.look(Usage(work * running, wait * running, at_disk), now)


@pytest.mark.parametrize("seed", range(20))
def test_a_grader_that_is_stopped_costs_nobody_a_point(seed):
    rng = random.Random(seed)
    gaps = [(rng.randrange(99), rng.choice([5.0, 12.0, 9e5])) for _ in range(5)]

    watch_for(3.0, work=0.6, gaps=gaps)
    watch_for(3.0, work=0.0, gaps=gaps)  # it has answered, and waits for the next order


@pytest.mark.parametrize("at_disk", [True, False])
def test_who_waits_for_disk_or_processor_is_not_taken_for_idle(at_disk):
    watch_for(20.0, work=0.05, wait=0.0 if at_disk else 0.9, at_disk=at_disk)


def test_code_that_waits_for_ever_is_ended():
    watch_for(MAX_IDLE + ALLOWED / 4.0)

    with pytest.raises(BoxTimeout):
        watch_for(MAX_IDLE + ALLOWED / 4.0 + 2.0 * LOOK, work=0.01)


@pytest.mark.parametrize("wait", [0.0, 0.5])
def test_code_that_works_is_ended_by_its_processor_time(wait):
    watch_for(ALLOWED / 0.5, work=0.5, wait=wait)

    with pytest.raises(BoxTimeout):
        watch_for(ALLOWED / 0.5 + 2.0 * LOOK, work=0.5, wait=wait)


def test_a_machine_that_is_too_busy_is_told_and_not_taken_for_the_code():
    watch_for(BUSY * ALLOWED, work=0.01, wait=0.9)

    with pytest.raises(MachineError, match="this machine was too busy"):
        watch_for(BUSY * ALLOWED + 2.0 * LOOK, work=0.01, wait=0.9)


def test_too_many_threads_end_the_box():
    watch = Watch(ALLOWED, Usage(0.0), now=0.0)
    watch.look(Usage(0.0, threads=MAX_THREADS), now=LOOK)

    with pytest.raises(BoxError, match="too many threads"):
        watch.look(Usage(0.0, threads=MAX_THREADS + 1), now=2.0 * LOOK)


def test_where_the_system_tells_nothing_the_seen_time_counts():
    watch = Watch(ALLOWED, None, now=0.0)
    watch.look(None, now=99.0)  # a grader that was stopped

    for k in range(1, round(ALLOWED / LOOK)):
        watch.look(None, now=99.0 + k * LOOK)
    with pytest.raises(BoxTimeout):
        watch.look(None, now=99.0 + ALLOWED)
