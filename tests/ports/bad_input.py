"""Commands that a port must refuse, each with a word that its message must hold."""

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

_FAULTY_SCANS = ("nan", "infinite", "word", "short", "long", "hole", "empty")
_FAULTY_PAIRS = ("nan_pairs", "short_pairs", "negative_weight", "empty", "good")
_FAULTY_PARAMETERS = [name for name in _TEXTS if name.endswith(".json") and name != "good.json"]

BAD_COMMANDS: dict[tuple[str, ...], str] = {
    ("match", "missing.csv", "good.csv", "good.json"): "missing.csv",
    ("match", "good.csv", "missing.csv", "good.json"): "missing.csv",
    ("match", "good.csv", "good.csv", "missing.json"): "missing.json",
    ("align", "missing.csv"): "missing.csv",
    ("integrate", "missing.csv", "0", "0", "0"): "missing.csv",
    **{("match", f"{name}.csv", "good.csv", "good.json"): f"{name}.csv" for name in _FAULTY_SCANS},
    ("match", "good.csv", "empty.csv", "good.json"): "empty.csv",
    **{("align", f"{name}.csv"): f"{name}.csv" for name in _FAULTY_PAIRS},
    ("integrate", "nan_increments.csv", "0", "0", "0"): "nan_increments.csv",
    ("integrate", "good.csv", "0", "0", "0"): "good.csv",
    ("integrate", "good3.csv", "0", "north", "0"): "north",
    **{("match", "good.csv", "good.csv", name): name for name in _FAULTY_PARAMETERS},
    ("align",): "",
    ("dance", "good.csv"): "",
}


def write_bad_files(folder: Path) -> None:
    """Put the files that the commands name into `folder`."""
    for name, text in _TEXTS.items():
        (folder / name).write_text(text)
