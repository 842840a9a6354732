#!/usr/bin/python3
"""usage: config_neighbours.py TRUNNION SOURCE_DIR [CASES [SEED]]

Wrong values for every key of the page, in a shipped config or a host of config_hosts.py: another type, a unit's text,
just outside the range, negative, zero, huge, NaN, empty, an unknown word, lists of another length. Misspelt keys, too,
and entries that stand there twice. Each is refused at its line, with its key and what is legal; or it is a value that
the page allows. Which ones are tried is drawn with a seed; `--accepted` behind it lists what was taken.
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

sys.path.insert(0, str(Path(__file__).resolve().parent))
import config_hosts  # noqa: E402

SHOWN = "--accepted" in sys.argv
ARGUMENTS = [a for a in sys.argv[1:] if a != "--accepted"]
BINARY, SOURCE = Path(ARGUMENTS[0]).resolve(), Path(ARGUMENTS[1]).resolve()
DRIVES = BINARY.parent / "trunnion-drives"  # which alone reads scripts of faults
CASES = int(ARGUMENTS[2]) if len(ARGUMENTS) > 2 else 500
SEED = int(ARGUMENTS[3]) if len(ARGUMENTS) > 3 else 26

spec = importlib.util.spec_from_file_location("config_command", SOURCE / "tests/app/cli/config_command.py")
command = importlib.util.module_from_spec(spec)
spec.loader.exec_module(command)

# Networks stand in a file of their own, which this config names.
NETWORKS = "configs/networks/micro_stage.toml"
NETWORKS_OF = "configs/micro_stage.toml"
BIG = "9" * 400


class Host:
    """A file that has tables of the page, and how it is read."""

    def __init__(self, name, text):
        self.name, self.text = name, text  # name: below the folder of the tests
        self.lines, self.here = text.splitlines(), list(command.headers_of(text))
        self.values = tomllib.loads(text)
        self.entries = {n: (t, k) for t, k, _, _, n in command.walk(self.values)}

    def read(self, folder, number, text):
        """The command that reads this text in place of the host's."""
        place = folder / Path(self.name).parent / f"case{number}.toml"
        place.write_text(text)
        run = [BINARY, "run", folder / "still.ngc", "--machine"]
        if self.name == NETWORKS:
            config = folder / f"configs/case{number}.toml"
            names_it = (SOURCE / NETWORKS_OF).read_text().replace("networks/micro_stage.toml", f"networks/{place.name}")
            config.write_text(names_it)
            return [*run, config], [place, config]
        if self.name.startswith("fault"):
            machine = folder / f"configs/{self.name[6:]}"
            return [DRIVES, "--machine", machine, "--can", "none9", "--faults", place], [place]
        return [*run, place], [place]


def all_hosts():
    for path in (p.resolve() for p in command.FILES):
        yield Host(str(path.relative_to(SOURCE)), path.read_text())
    for name, text in config_hosts.hosts(SOURCE):
        yield Host(f"configs/{name}", text)
    if DRIVES.exists():
        for config, text in config_hosts.FAULTS:
            yield Host(f"fault_{config}.toml", text)


def outside(row):
    """Numbers next to the ends of the row's range, on the wrong side."""
    for end, way in (("min", -1), ("max", 1)):
        if end in row:
            whole = row["form"] == "integer"
            yield str(int(row[end]) + way) if whole else repr(math.nextafter(row[end], way * math.inf))


def wrong_values(row, randomly):
    """Values of this row as they are written."""
    form, unit = row["form"], row.get("unit", "mm")
    if form in ("number", "integer"):
        values = ["-1", "0", "1e300", "-1e300", "nan", "inf", "-inf", '""', '"fast"', "true", "[1.0]", "1.5",
                  "-0.0", "1e-320", "1e-300", "1e16",
                  str(randomly.randrange(-10**9, 10**9)), "9223372036854775807", BIG,
                  "1979-05-27", "{a = 1}", f'"1 {unit}"', '"1"', '"1,5"', "1,5", "1" + unit, *outside(row)]
    elif form == "boolean":
        values = ["0", "1", '"true"', '"yes"', '""', "nan", "[true]", "True", "on"]
    elif form in ("numbers", "three_numbers"):
        values = ["[]", "[1.0]", "[1.0, 2.0, 3.0, 4.0, 5.0]", "[nan, 1.0, 2.0]", "[1e300, 1e300, 1e300]",
                  '["a", "b", "c"]', "[true, true, true]",
                  "[-1.0, -2.0, -3.0]", "7", '""', "[0.0, inf, 0.0]", "[1.0 2.0 3.0]", '"1, 2, 3"',
                  "[[1.0], [2.0], [3.0]]", "[0.0, 0.0, 0.0]", "true"]
    elif form == "texts":
        values = ["[7]", '"word"', "7", '[""]', '["no such thing"]', '[["a"]]', "[nan]", f'["{"x" * 5000}"]',
                  '["M3"]', '["a", "a"]']
    elif form == "choice":
        values = ['""', '"nonsense"', "7", "nan", '["a"]', "true", f'"{"x" * 5000}"', '"\\u0000"', "word"]
    else:
        values = ["7", "nan", "true", '["a"]', '""', '"no such thing"', f'"{"x" * 5000}"', '"\\u0000"', '"../../.."',
                  '" "', '"a\\nb"', '"\u00e4"', "word"]
    return values


class Case:
    """A host with one line that is other than it should be."""

    def __init__(self, host, numbered, key, value):
        self.host, self.numbered, self.key, self.value = host, numbered, key, value
        self.table, self.kind = host.entries[numbered]
        self.row = KEYS.rows.get((self.table, self.kind, key))
        lines = list(host.lines)
        self.line = line_of(host, numbered, key)
        if self.line is None:
            self.line = host.here.index(numbered) + 1
            lines.insert(self.line, f"{key} = {value}")
        else:
            end = self.line
            while lines[end].partition("#")[0].count("[") > lines[end].partition("#")[0].count("]"):
                end += 1  # a list of several lines
                lines[self.line] = lines[self.line].partition("#")[0] + lines[end]
                lines[end] = ""
                if lines[self.line].count("[") <= lines[self.line].count("]"):
                    break
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
        if code == 0:
            return "" if self.legal() else "was taken without a word"
        if self.legal():
            return ""  # another key may not go with it, or the machine cannot be run so
        return at_its_line(err, self.line, self.key)

    def __str__(self):
        return f"{Path(self.host.name).name} [{self.numbered}] ({self.kind}) {self.key} = {self.value[:60]}"


# Without them a bus is too slow, two motors differ, or another object is meant; that is told before the key is.
MISSED_ELSEWHERE = {"fd", "data_bitrate", "home_final_mm", "sub", "turnaround_ms"}


class Misspelt(Case):
    """A key that is nearly one of the page."""

    def __init__(self, host, numbered, key, wrong):
        super().__init__(host, numbered, key, "0")
        self.wrong = wrong
        lines = list(host.lines)
        lines[self.line] = wrong + lines[self.line][len(key):]
        self.text = "\n".join(lines) + "\n"

    def judge(self, code, err):
        if code == 0:
            return "was taken without a word"
        trouble = at_its_line(err, self.line, self.wrong, self.key)
        # What the key would have said is missed somewhere else, by its name; or its absence makes another error first.
        return "" if trouble.startswith("line ") and (self.key in err or self.key in MISSED_ELSEWHERE) else trouble

    def __str__(self):
        return f"{Path(self.host.name).name} [{self.numbered}] ({self.kind}) {self.wrong}"


# Entries that may stand there twice: each says something of its own. A part may be drawn by several files.
TWICE = re.compile(r"(^|\.)(script|write|plate|bore|boss|ball|fault|tool_branch|work_branch|drawing)$")


class Twice(Case):
    """An entry that stands there a second time."""

    def __init__(self, host, numbered):
        self.host, self.numbered, self.key = host, numbered, ""
        self.table, self.kind = host.entries[numbered]
        self.line = host.here.index(numbered)
        end = self.line
        while end < len(host.here) and (host.here[end] == numbered or host.here[end].startswith(numbered + ".")):
            end += 1
        self.text = "\n".join(host.lines[:end] + host.lines[self.line:end] + host.lines[end:]) + "\n"
        self.value = "twice"

    def legal(self):
        return bool(TWICE.search(self.table))

    def judge(self, code, err):
        if code == 0:
            return "" if self.legal() else "was taken without a word"
        return "" if re.match(r"[^:]+:\d+:\d+: .", err) else "no place"

    def __str__(self):
        return f"{Path(self.host.name).name} [[{self.table}]] ({self.kind}) twice"


def line_of(host, numbered, key):
    return next((i for i, line in enumerate(host.lines)
                 if host.here[i] == numbered and re.match(rf"{key} *= ", line)), None)


def at_its_line(err, line, *words):
    """"" if the error is at this line and has these words, or what is wrong with it."""
    place = re.match(r"[^:]+:(\d+):(\d+): (.*)", err)
    if not place:
        return "no place"
    if "Error while parsing" in place.group(3) or "missing key" in place.group(3):
        return ""  # it is no TOML at all, or another key is asked for first
    if int(place.group(1)) != line + 1:
        return f"line {place.group(1)} instead of {line + 1}"
    for word in words:
        if word not in place.group(3):
            return f"does not name {word}"
    return ""


def fits(host, numbered, key):
    """How well an entry goes with a key: it has the key; or keys of the same unit, as mm and degrees."""
    if line_of(host, numbered, key) is not None:
        return 2
    own = "\n".join(line for line, here in zip(host.lines, host.here)
                    if here == numbered or numbered.startswith(here + ".") and here.endswith("]"))
    linear, rotary = re.search(r'_mm\w* =|= "[XYZ]"', own), re.search(r'_deg\w* =|= "[ABC]"', own)
    unit = rotary if re.search(r"deg|Nm|kg_m2", key) else linear if re.search(r"mm|_N|_kg", key) else True
    return 1 if unit else 0


def misspelt(key):
    yield key[:-1] + ("x" if key[-1] != "x" else "y")
    if key.upper() != key:
        yield key.upper()


def cases(randomly):
    """Every key in the entry that goes best with it."""
    hosts = list(all_hosts())
    for (table, kind, key), row in KEYS.rows.items():
        places = [(fits(host, numbered, key), -i, host, numbered) for i, host in enumerate(hosts)
                  for numbered, of in host.entries.items() if of == (table, kind) and numbered in host.here]
        if not places:
            UNTRIED.append(f"[{table}] ({kind}) {key}")
            continue
        best = max(places, key=lambda place: place[:2])
        host, numbered = best[2:]
        for value in wrong_values(row, randomly):
            yield Case(host, numbered, key, value)
        if best[0] == 2:
            for wrong in misspelt(key):
                yield Misspelt(host, numbered, key, wrong)
    done = set()
    for host in hosts:
        for numbered, of in host.entries.items():
            if numbered.endswith("]") and of not in done and numbered in host.here:
                done.add(of)
                yield Twice(host, numbered)


def answer(folder, number, case):
    """(trouble, first line of the errors, exit code)"""
    line, files = case.host.read(folder, number, case.text)
    try:
        done = subprocess.run(line, capture_output=True, timeout=300)
    except subprocess.TimeoutExpired:
        return "takes longer than 300 s", "", -1
    for path in files:
        path.unlink()
    err, code = done.stderr.decode("utf-8", "replace"), done.returncode
    first = (err.splitlines() or [""])[0]
    if "none9" in err and code in (3, 4):
        code, first = 0, ""  # the script was read, and the bus does not exist
    if code < 0 or code > 5 or "TRN_CHECK" in err or "terminate" in err:
        return f"crashed ({code})", first, code
    if "internal check" in err:
        return "an internal check failed", first, code
    if code not in (0, 3, 4):
        return f"exit {code}", first, code
    return case.judge(code, first), first, code


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
        (place / "configs/drawn.stl").write_text(config_hosts.STL)
        with ThreadPoolExecutor(min(2, os.cpu_count())) as pool:
            answers = pool.map(lambda numbered: answer(place, *numbered), enumerate(tried))
            for case, (trouble, first, code) in zip(tried, answers):
                if trouble:
                    wrong.append(case)
                    print(f"{case}: {trouble}\n    {first[-250:]}", flush=True)
                elif SHOWN:
                    print(f"{'taken' if code == 0 else 'refused'}: {case}\n    {first[-250:]}")
    keys = len({(case.table, case.kind, case.key) for case in everything if type(case) is Case})
    for untried in UNTRIED:
        print(f"{untried}: no host has its table")
    print(f"{len(tried)} of {len(everything)} wrong values of {keys} of {len(KEYS.rows)} keys, seed {SEED}: "
          f"{len(wrong)} answered wrongly")
    return 1 if wrong or UNTRIED and DRIVES.exists() else 0


if __name__ == "__main__":
    KEYS, UNTRIED = command.Keys(), []
    sys.exit(main())
