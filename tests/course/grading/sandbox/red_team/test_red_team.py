"""Hostile submissions, by family: no wrong mark, no leak, no survivor, the batch goes on.

Each attack of `attacks/*.toml` is one submission with three questions. "before" and "after"
are answered honestly and must count; "attacked" holds the attack, whose function returns
the list of what it managed to do: it must be empty. "secret" asks for a number that no
honest code can know; whatever is forged, it must not come out.
"""

import os
import platform
import secrets
import tomllib
from pathlib import Path

import numpy as np
import pytest

from labkit.course.grading.contract import Call, OutcomeStatus, SourceCell
from labkit.course.grading.sandbox.host.launch import processes_of

HONEST = SourceCell(
    source="def before(x):\n    return 3 * x\n\ndef after(x):\n    return x + 1",
    question=None,
    label="cell 1",
)
FAMILIES = sorted((Path(__file__).parent / "attacks").glob("*.toml"))
ATTACKS = [
    pytest.param(attack | {"holds": family["holds_without_isolation"]}, id=name)
    for path in FAMILIES
    for family in [tomllib.loads(path.read_text("utf-8"))]
    for attack in family["attack"]
    for name in [f"{path.stem}: {attack['name']}"]
]
INPUT = np.linspace(0.0, 1.0, 5)
TOLERANCE = 1e-9


def submission(source):
    return [HONEST, SourceCell(source=source, question="attacked", label="cell 2")]


def call(question):
    return Call(id=question, question=question, function=question, arguments=(INPUT,))


def earned(outcome, reference):
    """The mark: only a returned array of the right numbers counts."""
    return (
        outcome.status is OutcomeStatus.RETURNED
        and type(outcome.value) is np.ndarray
        and outcome.value.shape == np.shape(reference)
        and bool(np.all(np.abs(outcome.value - reference) <= TOLERANCE))
    )


def survivors(sandbox):
    """Processes of the slot's user, while no submission runs; none can be another's."""
    user = getattr(sandbox._starter, "user", None)
    return processes_of(user.uid) if user else []


@pytest.mark.parametrize("attack", ATTACKS)
def test_the_sandbox_holds(slots, bait, attack):
    sandbox = slots["TIMEOUT" in attack["ends"]]
    if attack.get("machine", platform.machine()) != platform.machine():
        pytest.skip(f"the attack is machine code of {attack['machine']}")
    source = bait.aim(attack["cell"]).replace("@DEEP@", "(" * attack.get("deep", 0))
    untouched = bait.state()
    calls = [call(name) for name in ("before", "attacked", "secret", "after")]

    before, attacked, secret, after = outcomes = sandbox.run(submission(source), calls)

    assert attacked.status.name in attack["ends"], attacked
    if attacked.status is OutcomeStatus.RETURNED and attack.get("returns") != "anything":
        assert attacked.value == ()
    assert earned(before, 3 * INPUT), before
    assert earned(after, INPUT + 1), after
    assert not earned(secret, secrets.randbits(62) * np.ones(5))
    assert bait.secret not in "".join(map(repr, outcomes))
    assert all(len(o.message) <= 500 and o.message.isprintable() for o in outcomes)
    assert bait.state() == untouched
    assert not survivors(sandbox)
    if sandbox.mode == "none" and "next" not in attack:
        return  # each submission has a process of its own there
    next_one, honest = sandbox.run(
        submission(attack.get("next", "def attacked(x): return []")),
        [call("attacked"), call("after")],
    )
    assert next_one.value == ()
    assert earned(honest, INPUT + 1)


def test_nothing_is_left_on_disk(slots, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    cell = "for i in range(9): open(f'f{i}', 'w').write('x')\ndef attacked(x): return []"
    (outcome,) = slots[False].run(submission(cell), [call("attacked")])
    assert outcome.value == ()
    assert os.listdir(tmp_path) == []


def test_there_are_thirty_attacks_and_more():
    assert len(ATTACKS) >= 30
    assert len({attack.id for attack in ATTACKS}) == len(ATTACKS)
