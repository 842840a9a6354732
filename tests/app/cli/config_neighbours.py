#!/usr/bin/python3
"""usage: config_neighbours.py TRUNNION SOURCE_DIR [CASES [SEED]]

Wrong values for every key of the page, in every shipped config that has its table: another type, negative, zero, huge,
NaN, empty, an unknown word, lists of another length. Each is refused at its line, with its key and what is legal; or it
is a value that the page allows. Which ones are tried is drawn with a seed.
"""
import importlib.util
import math
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BINARY, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
CASES = int(sys.argv[3]) if len(sys.argv) > 3 else 500
SEED = int(sys.argv[4]) if len(sys.argv) > 4 else 26

spec = importlib.util.spec_from_file_location("config_command", SOURCE / "tests/app/cli/config_command.py")
command = importlib.util.module_from_spec(spec)
spec.loader.exec_module(command)

# The readers of other programs, and files that no machine's config is.
NOT_READ_BY_RUN = re.compile(r"^(fault|X|Y|X\.record|Y\.record|scope|lcm|access|gateway|gateway\.key)$")
BIG = "9" * 400


def tables_of(path):
    """(numbered table, table, type, line of its header) of a config."""
    text = path.read_text()
    places = {numbered: (table, kind)
              for table, kind, _, _, numbered in command.walk(tomllib.loads(text))}
    seen = set()
    for number, (line, here) in enumerate(zip(text.splitlines(), command.headers_of(text))):
        if line.startswith("[") and here in places and here not in seen:
            seen.add(here)
            yield (here, *places[here], number)


def wrong_values(row, randomly):
    """Values of this row as they are written."""
    form = row["form"]
    if form in ("number", "integer"):
        values = ["-1", "0", "1e300", "-1e300", "nan", "inf", "-inf", '""', '"fast"', "true", "[1.0]", "1.5",
                  "-0.0", "1e-320", str(randomly.randrange(-10**9, 10**9)), "9223372036854775807", BIG,
                  "1979-05-27", "{a = 1}"]
    elif form == "boolean":
        values = ["0", "1", '"true"', '"yes"', '""', "nan", "[true]"]
    elif form in ("numbers", "three_numbers"):
        values = ["[]", "[1.0]", "[1.0, 2.0, 3.0, 4.0, 5.0]", "[nan, 1.0, 2.0]", "[1e300, 1e300, 1e300]",
                  '["a", "b", "c"]',
                  "[-1.0, -2.0, -3.0]", "7", '""', "[0.0, inf, 0.0]",
                  "[[1.0], [2.0], [3.0]]", "[0.0, 0.0, 0.0]", "true"]
    elif form == "texts":
        values = ["[7]", '"word"', "7", '[""]', '["no such thing"]', '[["a"]]', "[nan]"]
    elif form == "choice":
        values = ['""', '"nonsense"', "7", "nan", '["a"]', "true", f'"{"x" * 5000}"', '"\\u0000"']
    else:
        values = ["7", "nan", "true", '["a"]', '""', '"no such thing"', f'"{"x" * 5000}"', '"\\u0000"', '"../../.."']
    return values


class Case:
    def __init__(self, path, numbered, table, kind, header, key, row, value):
        self.path, self.numbered, self.table, self.kind, self.key, self.row = path, numbered, table, kind, key, row
        self.value = value
        lines = path.read_text().splitlines()
        here = list(command.headers_of(path.read_text()))
        self.line = next((i for i, line in enumerate(lines)
                          if here[i] == numbered and re.match(rf"{key} = ", line)), None)
        if self.line is None:
            self.line = header + 1
            lines.insert(self.line, "")
        elif "[" in lines[self.line] and lines[self.line].count("[") > lines[self.line].count("]"):
            self.line = None  # a list of several lines
            return
        lines[self.line] = f"{key} = {value}"
        self.text = "\n".join(lines) + "\n"

    def legal(self):
        """Whether the page allows the value."""
        try:
            value = tomllib.loads(f"v = {self.value}")["v"]
        except (tomllib.TOMLDecodeError, ValueError):
            return False
        if isinstance(value, float) and not math.isfinite(value):
            return False
        if isinstance(value, list) and any(isinstance(v, float) and not math.isfinite(v) for v in value):
            return False
        if self.row["form"] in ("numbers", "three_numbers") and isinstance(value, list):
            if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in value):
                return False
        return command.of_form(value, self.row)

    def judge(self, code, err):
        """"" or what is wrong with the answer."""
        first = (err.splitlines() or [""])[0]
        if code < 0 or code > 5 or "TRN_CHECK" in err or "terminate" in err:
            return f"crashed ({code})"
        if code == 0:
            return "" if self.legal() else "was taken without a word"
        if code not in (3, 4):
            return f"exit {code}"
        if "internal check" in err:
            return "an internal check failed"
        if self.legal():
            return ""  # another key may not go with it, or the machine cannot be run so
        place = re.match(r"[^:]+:(\d+):(\d+): (.*)", first)
        if not place:
            return "no place"
        if "Error while parsing" in place.group(3) or "missing key" in place.group(3):
            return ""  # it is no TOML at all, or another key is asked for first
        if int(place.group(1)) != self.line + 1:
            return f"line {place.group(1)} instead of {self.line + 1}"
        if self.key not in place.group(3):
            return "does not name the key"
        return ""


def cases(randomly):
    """Every key at the first place that has its table."""
    done = set()
    for path in (p.resolve() for p in command.FILES):
        if path.parent.name == "networks":
            continue
        for numbered, table, kind, header in tables_of(path):
            if NOT_READ_BY_RUN.match(table):
                continue
            for (t, k, key), row in KEYS.rows.items():
                if (t, k) != (table, kind) or (t, k, key) in done:
                    continue
                done.add((t, k, key))
                for value in wrong_values(row, randomly):
                    case = Case(path, numbered, table, kind, header, key, row, value)
                    if case.line is not None:
                        yield case


def main():
    randomly = random.Random(SEED)
    everything = list(cases(randomly))
    tried = everything if len(everything) <= CASES else randomly.sample(everything, CASES)
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name in ("configs", "examples", "tests/data/machines"):
            shutil.copytree(SOURCE / name, place / name, dirs_exist_ok=True)
        (place / "still.ngc").write_text("G21 G90\nM2\n")

        def one(numbered):
            i, case = numbered
            path = place / case.path.relative_to(SOURCE).parent / f"case{i}.toml"
            path.write_text(case.text)
            try:
                done = subprocess.run([BINARY, "run", place / "still.ngc", "--machine", path], capture_output=True,
                                      timeout=60)
                err = done.stderr.decode("utf-8", "replace")
            except subprocess.TimeoutExpired:
                return case, "takes longer than 60 s", ""
            path.unlink()
            return case, case.judge(done.returncode, err), (err.splitlines() or [""])[0]

        with ThreadPoolExecutor(min(2, os.cpu_count())) as pool:
            for case, trouble, first in pool.map(one, enumerate(tried)):
                if trouble:
                    wrong.append(case)
                    print(f"{case.path.name} [{case.numbered}] ({case.kind}) {case.key} = {case.value[:60]}: {trouble}")
                    print(f"    {first[-200:]}")
    keys = len({(case.table, case.kind, case.key) for case in everything})
    print(f"{len(tried)} of {len(everything)} wrong values of {keys} keys, seed {SEED}: {len(wrong)} answered wrongly")
    return 1 if wrong else 0


if __name__ == "__main__":
    KEYS = command.Keys()
    sys.exit(main())
