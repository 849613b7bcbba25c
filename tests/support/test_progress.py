from labkit.support import progress as module
from labkit.support.progress import progress


def test_a_log_gets_a_line_each_time_that_is_due_and_all_items(monkeypatch, capsys):
    clock = iter(range(0, 1000, 4))  # each look at it is four seconds later
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    assert list(progress(range(9), what="matching", total=9)) == list(range(9))
    assert capsys.readouterr().err.split("\n")[:2] == ["matching: 3 of 9", "matching: 6 of 9"]
