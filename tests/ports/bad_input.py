"""Commands that a port must refuse, each with a pattern that its message must match."""

from pathlib import Path

_TEXTS = {
    "good.csv": "0,0\n4,0\n0,3\n",
    "good3.csv": "1,2,0.5\n",
    "good.json": "{}\n",
    "nan.csv": "0,0\n1,nan\n2,3\n",
    "infinite.csv": "0,0\n1,inf\n2,3\n",
    "word.csv": "0,0\n1,two\n2,3\n",
    "short.csv": "0,0\n1\n2,3\n",
    "long.csv": "0,0\n1,2,3\n2,3\n",
    "hole.csv": "0,0\n1,\n2,3\n",
    "empty.csv": "",
    "nan_pairs.csv": "0,0,1,1\n1,0,NaN,1\n",
    "short_pairs.csv": "0,0,1,1\n1,0,1\n",
    "negative_weight.csv": "0,0,1,1,1\n1,0,2,1,-1\n",
    "nan_increments.csv": "1,0,0\n1,0,nan\n",
    "cut.json": '{"overlap_ratio": 0.8',
    "list.json": "[0.8]\n",
    "trailing.json": "{} 1\n",
    "empty.json": "",
    "unknown.json": '{"overlap": 0.8}\n',
    "text.json": '{"overlap_ratio": "0.8"}\n',
    "nan.json": '{"overlap_ratio": NaN}\n',
    "overlap.json": '{"overlap_ratio": 1.3}\n',
    "overlap_null.json": '{"overlap_ratio": null}\n',
    "gate.json": '{"max_correspondence_distance": 0}\n',
    "delta.json": '{"huber_delta": -0.2}\n',
    "iterations.json": '{"max_iterations": 2.5}\n',
    "no_iterations.json": '{"max_iterations": 0}\n',
    "tolerance.json": '{"cost_tolerance": -1e-9}\n',
}

# Place and value: FILE:LINE in a table; FILE and, where there is one, the value in JSON.
_FAULTY_SCANS = {
    "nan.csv": ":2: .*nan",
    "infinite.csv": ":2: .*inf",
    "word.csv": ":2: .*two",
    "short.csv": ":2: ",
    "long.csv": ":2: ",
    "hole.csv": ":2: ",
    "empty.csv": "",
}
_FAULTY_PAIRS = {
    "nan_pairs.csv": ":2: .*NaN",
    "short_pairs.csv": ":2: ",
    "negative_weight.csv": ":2: a weight .*at least 0, got -1",
    "empty.csv": "",
    "good.csv": ":1: ",
}
_FAULTY_PARAMETERS = {
    "cut.json": "",
    "list.json": "",
    "trailing.json": "",
    "empty.json": "",
    "unknown.json": ".*unknown key .overlap.; known are .*overlap_ratio",
    "text.json": ".*0.8",
    "nan.json": ".*NaN",
    "overlap.json": r".*overlap_ratio.*must be in \(0, 1\], got 1.3",
    "overlap_null.json": ".*overlap_ratio.*null",
    "gate.json": ".*max_correspondence_distance.*must be .*got 0",
    "delta.json": ".*huber_delta.*must be .*got -0.2",
    "iterations.json": ".*max_iterations.*whole number.*got 2.5",
    "no_iterations.json": ".*max_iterations.*must be .*got 0",
    "tolerance.json": ".*cost_tolerance.*must be .*got -1",
}

BAD_COMMANDS: dict[tuple[str, ...], str] = {
    ("match", "missing.csv", "good.csv", "good.json"): "missing.csv",
    ("match", "good.csv", "missing.csv", "good.json"): "missing.csv",
    ("match", "good.csv", "good.csv", "missing.json"): "missing.json",
    ("align", "missing.csv"): "missing.csv",
    ("integrate", "missing.csv", "0", "0", "0"): "missing.csv",
    **{("match", name, "good.csv", "good.json"): name + why for name, why in _FAULTY_SCANS.items()},
    ("match", "good.csv", "empty.csv", "good.json"): "empty.csv",
    **{("align", name): name + why for name, why in _FAULTY_PAIRS.items()},
    ("integrate", "nan_increments.csv", "0", "0", "0"): "nan_increments.csv:2: .*nan",
    ("integrate", "good.csv", "0", "0", "0"): "good.csv:1: ",
    ("integrate", "good3.csv", "0", "north", "0"): "north",
    **{
        ("match", "good.csv", "good.csv", name): name + why
        for name, why in _FAULTY_PARAMETERS.items()
    },
    ("align",): "",
    ("dance", "good.csv"): "",
}


def write_bad_files(folder: Path) -> None:
    """Put the files that the commands name into `folder`."""
    for name, text in _TEXTS.items():
        (folder / name).write_text(text)
