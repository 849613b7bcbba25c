"""Files on the border of what a port may read, with the verdict that all ports share."""

from pathlib import Path

ACCEPTED_SCANS = {
    "crlf": "0,0\r\n4,0\r\n0,3\r\n",
    "no_newline": "0,0\n4,0\n0,3",
    "spaces": " 0 , 0\n4 ,0\n0,\t3\n",
    "tiny_number": "0,1e-400\n4,0\n0,3\n",
    "plus": "+0,+0\n4,0\n0,3\n",
    "dot_end": "0.,0\n4,.5\n0,3\n",
    "long_digits": "0." + "1" * 400 + ",0\n4,0\n0,3\n",
    "many_exp": "1e0000000000001,0\n4,0\n0,3\n",
    "exp_huge_neg": "1e-99999,0\n4,0\n0,3\n",
    "zero_exp_huge": "0e99999,0\n4,0\n0,3\n",
}

REFUSED_SCANS = {
    "cr_only": "0,0\r4,0\r0,3\r",
    "bom": "\ufeff0,0\n4,0\n0,3\n",
    "blank_middle": "0,0\n\n4,0\n0,3\n",
    "blank_end": "0,0\n4,0\n0,3\n\n",
    "blank_start": "\n0,0\n4,0\n0,3\n",
    "spaces_line": "0,0\n  \n4,0\n0,3\n",
    "trailing_comma": "0,0,\n4,0,\n0,3,\n",
    "huge_number": "0,1e400\n4,0\n0,3\n",
    "dot": ".,0\n4,.5\n0,3\n",
    "e_only": "1e,0\n4,0\n0,3\n",
    "d_exponent": "1d3,0\n4,0\n0,3\n",
    "f_suffix": "1f,0\n4,0\n0,3\n",
    "hex": "0x10,0\n4,0\n0,3\n",
    "underscore": "1_0,0\n4,0\n0,3\n",
    "complex": "1i,0\n4,0\n0,3\n",
    "inf": "-inf,0\n4,0\n0,3\n",
    "infinity": "Infinity,0\n4,0\n0,3\n",
    "nan": "nan,0\n4,0\n0,3\n",
    "semicolon": "0;0\n4;0\n0;3\n",
    "tab": "0\t0\n4\t0\n",
    "header": "x,y\n0,0\n4,0\n0,3\n",
    "quoted": '"0","0"\n4,0\n0,3\n',
    "comment": "# x,y\n0,0\n4,0\n0,3\n",
    "nul": "0,0\n4,0\x00\n0,3\n",
    "arabic": "\u0663,0\n4,0\n0,3\n",
    "minus_unicode": "\u22121,0\n4,0\n0,3\n",
    "empty": "",
    "newline": "\n",
    "only_comma": ",\n",
    "double_minus": "--1,0\n4,0\n0,3\n",
    "expr": "1+1,0\n4,0\n0,3\n",
    "nbsp": "0,\xa00\n4,0\n0,3\n",
    "form_feed": "0,0\x0c\n4,0\n0,3\n",
}

ACCEPTED_PARAMETERS = {
    "empty_object": "{}",
    "blanks": " \r\n\t{ \n} \n",
    "crlf": '{\r\n"overlap_ratio": 0.8\r\n}\r\n',
    "gate_null": '{"max_correspondence_distance": null, "huber_delta": null}',
    "overlap_1": '{"overlap_ratio": 1}',
    "overlap_1.0": '{"overlap_ratio": 1.0}',
    "overlap_100e-2": '{"overlap_ratio": 100e-2}',
    "iter_60.0": '{"max_iterations": 60.0}',
    "iter_6e1": '{"max_iterations": 6e1}',
    "iter_1e300": '{"max_iterations": 1e300}',
    "tol_0": '{"cost_tolerance": 0}',
    "tol_neg0": '{"cost_tolerance": -0}',
    "initial_1e308": '{"initial_x": 1e308}',
}

REFUSED_PARAMETERS = {
    "bom": "\ufeff{}",
    "trailing_comma": '{"overlap_ratio": 0.8,}',
    "leading_comma": '{,"overlap_ratio": 0.8}',
    "two_commas": '{"overlap_ratio": 0.8,,"huber_delta": 1}',
    "dup": '{"overlap_ratio": 0.8, "overlap_ratio": 0.8}',
    "unknown": '{"overlap": 1}',
    "case": '{"Overlap_ratio": 0.8}',
    "dash_key": '{"overlap-ratio": 0.8}',
    "empty_key": '{"": 1}',
    "string": '{"overlap_ratio": "0.8"}',
    "true": '{"overlap_ratio": true}',
    "list": '{"overlap_ratio": [0.8]}',
    "object": '{"overlap_ratio": {}}',
    "null": '{"overlap_ratio": null}',
    "gate_neg": '{"max_correspondence_distance": -0.5}',
    "gate_zero": '{"max_correspondence_distance": 0}',
    "gate_1e400": '{"max_correspondence_distance": 1e400}',
    "overlap_0": '{"overlap_ratio": 0}',
    "overlap_big": '{"overlap_ratio": 1.0000001}',
    "plus": '{"overlap_ratio": +0.8}',
    "lead_zero": '{"overlap_ratio": 00.8}',
    "dot_start": '{"overlap_ratio": .8}',
    "dot_end": '{"overlap_ratio": 1.}',
    "nan": '{"overlap_ratio": NaN}',
    "inf": '{"huber_delta": Infinity}',
    "single_quotes": "{'overlap_ratio': 0.8}",
    "no_quotes": "{overlap_ratio: 0.8}",
    "comment": '{"overlap_ratio": 0.8} // x',
    "comment2": "/* */ {}",
    "two_objects": "{} {}",
    "array_top": "[]",
    "null_top": "null",
    "number_top": "1",
    "empty": "",
    "cut": '{"overlap_ratio"',
    "cut2": '{"overlap_ratio": 0.8',
    "no_colon": '{"overlap_ratio" 0.8}',
    "no_comma": '{"overlap_ratio": 0.8 "huber_delta": 1}',
    "iter_2.5": '{"max_iterations": 2.5}',
    "iter_0": '{"max_iterations": 0}',
    "iter_neg": '{"max_iterations": -3}',
    "iter_null": '{"max_iterations": null}',
    "tol_neg": '{"rotation_tolerance": -1}',
    "initial_null": '{"initial_x": null}',
    "initial_1e400": '{"initial_x": 1e400}',
    "initial_string": '{"initial_theta": "1"}',
    "escaped_key": '{"overlap\\u005fratio": 0.8}',
    "bad_escape_key": '{"\\x": 1}',
    "nul": "{}\x00",
    "vt": "\x0b{}",
    "nbsp": "\xa0{}",
    "tiny": '{"overlap_ratio": 1e-400}',
    "e_only": '{"overlap_ratio": 1e}',
    "deep": "[" * 500 + "]" * 500,
    "brace_in_key": '{"}": 1}',
    "colon_in_key": '{"a:b": 1}',
    "string_top": '"overlap_ratio"',
    "nullnull": '{"overlap_ratio": nullnull}',
    "hex": '{"overlap_ratio": 0x1}',
}

ACCEPTED_PAIRS = {
    "mixed": "0,0,1,1\n1,0,2,1,2\n",
    "weight_0": "0,0,1,1,0\n1,0,2,1,1\n0,1,1,2,1\n",
    "weight_neg0": "0,0,1,1,-0\n1,0,2,1,1\n0,1,1,2,1\n",
}

REFUSED_PAIRS = {
    "weight_neg": "0,0,1,1,1\n1,0,2,1,-1e-300\n",
    "weight_empty": "0,0,1,1,\n1,0,2,1,1\n",
    "weight_inf": "0,0,1,1,1e400\n1,0,2,1,1\n",
    "six_fields": "0,0,1,1,1,1\n1,0,2,1,1,1\n",
}

REFUSED_WORDS = (
    "match scan.csv latin.csv defaults.json",
    "match scan.csv folder defaults.json",
    "match scan.csv scan.csv folder",
    "match scan.csv scan.csv",
    "match",
    "match scan.csv scan.csv defaults.json more",
    "Match scan.csv scan.csv defaults.json",
    "align folder",
    "integrate scan.csv 0 0",
    "integrate folder 0 0 0",
    "demo",
    "demo -1",
    "demo 1.5",
    "demo 1e3",
    "demo 4294967296",
    "demo x",
)

SCAN = "0,0\n4,0\n0,3\n4,3\n2,1\n"


def verdicts(folder: Path) -> dict[str, bool]:
    """Write the files into `folder`; whether each command is to be accepted."""
    (folder / "scan.csv").write_text(SCAN)
    (folder / "defaults.json").write_text("{}")
    (folder / "folder").mkdir()
    (folder / "latin.csv").write_bytes(b"0,0\n\xe9,1\n2,3\n")
    expected = dict.fromkeys(REFUSED_WORDS, False)
    for scans, accepted in ((ACCEPTED_SCANS, True), (REFUSED_SCANS, False)):
        for name, text in scans.items():
            (folder / f"{name}.csv").write_bytes(text.encode())
            expected[f"match scan.csv {name}.csv defaults.json"] = accepted
    for pairs, accepted in ((ACCEPTED_PAIRS, True), (REFUSED_PAIRS, False)):
        for name, text in pairs.items():
            (folder / f"{name}.csv").write_bytes(text.encode())
            expected[f"align {name}.csv"] = accepted
    for parameters, accepted in ((ACCEPTED_PARAMETERS, True), (REFUSED_PARAMETERS, False)):
        for name, text in parameters.items():
            (folder / f"{name}.json").write_bytes(text.encode())
            expected[f"match scan.csv scan.csv {name}.json"] = accepted
    return expected
