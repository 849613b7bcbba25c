"""The stopwatch: every matcher on every pair, in turns, so that all meet the same machine."""

from __future__ import annotations

import gc
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from tqdm import tqdm

from data import Pair, PairSet
from labkit.support.arrays import FloatArray
from peers import Matcher

CLOCKS = ("wall", "processor")
WARM_UP = 3  # pairs that each matcher meets before the clock runs
STRETCH = 20  # pairs that a matcher is given in one turn, as it would be given those of a log


@dataclass(frozen=True, eq=False, kw_only=True)
class Attempt:
    """One match: how long it took [s] and what came out; all NaN where nothing did.

    `wall` is what a watch says, `processor` for how long all threads together were at work:
    no more than that on an idle machine, and the better measure on a busy one.
    """

    wall: float
    processor: float
    T: FloatArray
    iterations: int | None = None
    complaint: str = ""


@dataclass(eq=False, kw_only=True)
class Run:
    """All attempts of one matcher, pair by pair; every round adds one to each."""

    attempts: list[list[Attempt]] = field(default_factory=list)

    def seconds(self, clock: str) -> FloatArray:
        """The time of every attempt by one of `CLOCKS`, shape (attempts,)."""
        return np.array([getattr(attempt, clock) for pair in self.attempts for attempt in pair])

    @property
    def first(self) -> list[Attempt]:
        """One attempt a pair; all matchers give the same answer every time."""
        return [pair[0] for pair in self.attempts]


def attempt(matcher: Matcher, pair: Pair, gate: float) -> Attempt:
    """Match one pair under the clock; whatever a library throws is an answer not given."""
    arguments = matcher.arguments(pair, gate)
    T, iterations, complaint = np.full((3, 3), np.nan), None, ""
    gc.disable()
    began = time.perf_counter(), time.process_time()
    try:
        T, iterations = matcher.function(*arguments)
    except Exception as error:
        complaint = repr(error)
    finally:
        ended = time.perf_counter(), time.process_time()
        gc.enable()
    wall, processor = (end - begin for begin, end in zip(began, ended, strict=True))
    return Attempt(wall=wall, processor=processor, T=T, iterations=iterations, complaint=complaint)


def measure(matchers: Sequence[Matcher], pair_set: PairSet, rounds: int) -> dict[str, Run]:
    """Every matcher on every pair, `rounds` times, in turns of a stretch of pairs.

    The one that begins changes each time. Turns of a single pair would time, for the most
    part, how a processor's caches are filled again after all the other libraries.
    """
    runs = {
        matcher.name: Run(attempts=[[] for _ in matcher.share(pair_set.pairs)])
        for matcher in matchers
        if matcher.share(pair_set.pairs)
    }
    matchers = [matcher for matcher in matchers if matcher.name in runs]
    for matcher in matchers:
        for pair in matcher.share(pair_set.pairs)[:WARM_UP]:
            attempt(matcher, pair, pair_set.gate)
    turns = deque(matchers)
    for number in range(rounds):
        label = f"{pair_set.name}, round {number + 1} of {rounds}"
        starts = range(0, len(pair_set.pairs), STRETCH)
        for start in tqdm(starts, label, leave=False, disable=None):
            for matcher in turns:
                if matcher.slow and number:
                    continue
                attempts = runs[matcher.name].attempts[start : start + STRETCH]
                for tried, pair in zip(attempts, pair_set.pairs[start:], strict=False):
                    tried.append(attempt(matcher, pair, pair_set.gate))
            turns.rotate(1)
    return runs
