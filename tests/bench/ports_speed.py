"""Time every port on the same pairs: ``python tests/bench/ports_speed.py [OPTIONS]``.

A port answers a batch that holds one `match` command many times, and one that holds it
twice as often; the difference is that many matches without start-up and warming up.
Reading the files and printing the answer are in it, for labkit too, which runs in this
process. It is processor time, of all threads, so that what else the machine does is not
in it. The ports take turns, so that all meet the same machine; medians are printed.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2]))

from machine import describe_machine
from tests.conformance.reference import answer, read_files
from tests.ports.ports import PORTS, Port, execute
from tests.ports.runner import CONFORMANCE, VECTORS, distances

PAIRS = ("killian_120", "small_defaults")  # a recorded pair, and one for slow interpreters
ENOUGH = 1.0  # s that the matches of the smaller batch must take
MOST = 4096  # of them

Stopwatch = Callable[[int], float]  # the processor seconds that so many matches take


def labkit_stopwatch(command: list[str]) -> Stopwatch:
    """Matches in this process, each from its files to its JSON."""

    def seconds(matches: int) -> float:
        began = time.process_time()
        for _ in range(matches):
            json.dumps(answer(command, read_files(CONFORMANCE, [command])))
        return time.process_time() - began

    return seconds


def port_stopwatch(port: Port, folder: Path, command: list[str]) -> Stopwatch:
    """Matches in one process of a port that is built in `folder`."""
    line = " ".join(command) + "\n"

    def seconds(matches: int) -> float:
        commands = folder / "commands.txt"
        commands.write_text(line * matches)
        began = _processor_time_of_children()
        outcome = execute([*port.start(port.sources, folder), "batch", commands])
        took = _processor_time_of_children() - began
        if outcome.returncode or len(outcome.stdout.splitlines()) != matches:
            raise RuntimeError(f"{port.language} did not answer: {outcome.stderr}")
        return took

    return seconds


def _processor_time_of_children() -> float:
    times = os.times()
    return times.children_user + times.children_system


def enough_matches(seconds: Stopwatch) -> int:
    """So many matches that they take a while beside starting up."""
    alone, matches = seconds(1), 2
    while matches < MOST and seconds(matches) - alone < ENOUGH:
        matches *= 2
    return matches


def measure(stopwatches: dict[str, Stopwatch], rounds: int) -> dict[str, float]:
    """The median time of one match in ms, by language."""
    matches = {language: enough_matches(seconds) for language, seconds in stopwatches.items()}
    times: dict[str, list[float]] = {language: [] for language in stopwatches}
    for _ in range(rounds):
        for language, seconds in stopwatches.items():
            many = matches[language]
            times[language].append((seconds(2 * many) - seconds(many)) / many)
    return {language: 1e3 * statistics.median(taken) for language, taken in times.items()}


def main() -> None:
    """Print a table for each pair."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--pairs", nargs="+", default=PAIRS, help="names of `match` vectors")
    options = parser.parse_args()
    usable = [port for port in PORTS if port.missing is None]
    print(*describe_machine().values(), "| load", *(f"{load:.1f}" for load in os.getloadavg()))
    with tempfile.TemporaryDirectory() as place:
        folders = {port.name: Path(place) / port.name for port in usable}
        for port in usable:
            folder = folders[port.name]
            folder.mkdir()
            port.build(port.sources, folder)
            (folder / "data").symlink_to(CONFORMANCE / "data")
        for name in options.pairs:
            vector = next(vector for vector in VECTORS if vector["name"] == name)
            command = vector["command"]
            stopwatches = {"labkit": labkit_stopwatch(command)} | {
                port.language: port_stopwatch(port, folders[port.name], command)
                for port in usable
                if distances(vector) <= port.most_distances
            }
            milliseconds = measure(stopwatches, options.rounds)
            print(f"\n{name:16}{'ms':>10}{'ratio':>9}")
            for language, taken in milliseconds.items():
                print(f"{language:16}{taken:10.3f}{taken / milliseconds['labkit']:9.2f}")


if __name__ == "__main__":
    main()
