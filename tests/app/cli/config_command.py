#!/usr/bin/python3
"""usage: config_command.py TRUNNION SOURCE_DIR

docs/config.md is what `trunnion config --keys` says; every key of a shipped config, of an example in the documents and
of the source stands there; and what it says of a key is what happens to a config that does otherwise.
"""
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BINARY, SOURCE = sys.argv[1], Path(sys.argv[2])
sys.path.insert(0, str(SOURCE / "tests/style"))
from source_text import TOKEN, source_files  # noqa: E402

sys.path.insert(0, str(SOURCE / "tests/support"))
from instrumented import sanitized  # noqa: E402

CONFIGS = sorted((SOURCE / "configs").glob("*.toml"))
FILES = CONFIGS + sorted(path for folder in ("configs/networks", "examples", "tests/data/machines")
                         for path in (SOURCE / folder).glob("*.toml"))
PATIENCE_S = 1800 if sanitized(BINARY) else 120  # drives that never get power are watched for 1,200 s of the machine
IO_TYPE = "simulated"  # of an [io] without type


def trunnion(*arguments, cwd=None):
    done = subprocess.run([BINARY, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE_S, cwd=cwd)
    return done.returncode, done.stdout, done.stderr


class Keys:
    """What `trunnion config --keys --json` says, by table, type and key."""

    def __init__(self):
        code, out, err = trunnion("config", "--keys", "--json")
        assert code == 0, err
        self.tables = json.loads(out)["tables"]
        self.rows = {(t["table"], t["type"], k["key"]): k for t in self.tables for k in t["keys"]}
        self.names = {k["key"] for t in self.tables for k in t["keys"]}
        self.table_names = {part for t in self.tables for part in t["table"].split(".")}

    def row(self, table, kind, key):
        """The row of a key; `kind` None: of any type."""
        if kind is not None:
            return self.rows.get((table, kind, key))
        return next((row for (t, _, k), row in self.rows.items() if (t, k) == (table, key)), None)


def walk(values, table="", kind="", numbered=""):
    """(table, type around it, key, value, table with numbers) of every key that is no table."""
    kind = values.get("type", IO_TYPE if table == "io" else kind) if table else ""
    for key, value in values.items():
        path, numbers = (f"{table}.{key}", f"{numbered}.{key}") if table else (key, key)
        if isinstance(value, dict):
            yield from walk(value, path, kind, numbers)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for i, entry in enumerate(value):
                yield from walk(entry, path, kind, f"{numbers}[{i}]")
        else:
            yield table, kind, key, value, numbered


def of_form(value, row):
    """Whether a value is of the form and in the range that its row says."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if row["form"] in ("number", "integer"):
        whole = row["form"] == "number" or isinstance(value, int)
        return (number and whole and row.get("min", -math.inf) <= value <= row.get("max", math.inf)
                and value > row.get("above", -math.inf))
    if row["form"] == "boolean":
        return isinstance(value, bool)
    if row["form"] in ("numbers", "three_numbers"):
        return isinstance(value, list) and (row["form"] == "numbers" or len(value) == 3)
    if row["form"] == "texts":
        return isinstance(value, list) and all(isinstance(v, str) for v in value)
    return isinstance(value, str) and value in row.get("choices", [value])


class Page(unittest.TestCase):
    def test_the_page_in_the_tree_is_what_the_readers_say(self):
        code, page, err = trunnion("config", "--keys")
        self.assertEqual(code, 0, err)
        self.assertEqual((SOURCE / "docs/config.md").read_text(), page,
                         "docs/config.md is stale: trunnion config --keys > docs/config.md")

    def test_every_row_has_five_cells(self):
        for line in (SOURCE / "docs/config.md").read_text().splitlines():
            if line.startswith("|"):
                self.assertEqual(len(re.split(r"(?<!\\)\|", line)), 7, line)

    def test_links_within_the_page_lead_to_headings(self):
        text = (SOURCE / "docs/config.md").read_text()
        headings = {re.sub(r"[^a-z0-9-]", "", h.lower().replace(" ", "-")) for h in re.findall(r"^## (.*)", text, re.M)}
        links = set(re.findall(r"\]\(#([^)]*)\)", text))
        self.assertEqual(links, headings)

    def test_meanings_are_sentences(self):
        for place, row in KEYS.rows.items():
            self.assertRegex(row["meaning"], r"^[A-Z0-9`].*\.$", place)

    def test_the_flag_is_needed(self):
        self.assertEqual(trunnion("config")[0], 5)


class Complete(unittest.TestCase):
    def test_every_key_of_the_shipped_files(self):
        count = 0
        for path in FILES:
            for table, kind, key, value, _ in walk(tomllib.loads(path.read_text())):
                row = KEYS.row(table, kind, key)
                self.assertIsNotNone(row, f"{path.name}: [{table}] ({kind}) {key} is not on the page")
                self.assertTrue(of_form(value, row), f"{path.name}: {key} = {value!r} is not as the page has it")
                count += 1
        self.assertGreater(count, 1000)

    def test_every_key_of_the_documents_examples(self):
        count = 0
        for path in [SOURCE / "README.md", *sorted((SOURCE / "docs").glob("*.md"))]:
            for fence in re.findall(r"^```toml\n(.*?)^```", path.read_text(), re.S | re.M):
                for table, kind, key, _, _ in walk(tomllib.loads(fence)):
                    self.assertIsNotNone(KEYS.row(table, kind or None, key), f"{path.name}: [{table}] {key}")
                    count += 1
        self.assertGreater(count, 60)


# How the source asks for a key.
READ = re.compile(r"(?:\.|->)(?:number|integer|boolean|text|choice|vec3|numbers|texts|table|table_if|tables|"
                  r"tables_if|has|error)\((?=[^){])")
HANDED_ON = re.compile(r"\b(\w+)\((?:[\w.]+, *)*\*?(?:\w*table|entry|section|io|root|drives|axis|spindle), *"
                       r"(?=\"|fmt::format)")
NOT_OF_KEYS = {"read_budget", "read_common"}  # they take a correction's name, a unit
# Expressions without a text of their own: where their texts stand in the same file, or the one named below; None: with
# the callers.
ELSEWHERE = {
    "key": r"\bkey = (?!\[)([^;]*);", "key.c_str()": None, "at": r"\bat = ([^;,]*)[;,]", "at.c_str()": None,
    "forward": r"\bforward = ([^;,]*)[;,]", "backward": r"\bbackward = ([^;,]*)[;,]",
    "kStageAxes[i]": r"\bkStageAxes\[\] = \{(\"\w+\")", "kind.name": r"CorrectionKind kKinds\[\] = \{(.*?)\n\};",
    "list": r"platform_json\(section, (\"\w+\")", "place": r"(?<=[{ ])(\"\w+\")(?=[,}][^)]*\}\))",
    "owned.key": r"kOwned\[\] = \{(.*?)\};", "error.key": r"DriveUnitError\(\s*(\"\w+\")",
    "wave": r"\bwave = ([^;,]*)[;,]", "pitch": r"\bpitch = ([^;,]*)[;,]",
    "name": r"(?:needs_object|read_option)\(node, (\"\w+\")",
    "key.name": r"std::vector<TuneLine> lines_of\((.*?)\n\}"}
IN_FILE = {"kStageAxes[i]": "compensation/micromill/friction_network.h", "error.key": "hal/can/drive_units.cc",
           "key.name": "app/lab/tune/tune_report.cc"}
TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"')


def argument(text, at):
    """The expression that begins here, up to the comma or bracket behind it."""
    depth, i = 0, at
    while depth > 0 or text[i] not in ",)":
        if text[i] == '"':
            i = TEXT.match(text, i).end()
            continue
        depth += (text[i] in "([{") - (text[i] in ")]}")
        i += 1
    return " ".join(text[at:i].split())


def patterns_of(expression):
    """Expressions for the keys that this one may be: its texts, with anything for what is between them."""
    found = []
    for branch in re.split(r"[?:](?!:)", expression) if "?" in expression else [expression]:
        texts = TEXT.findall(branch)
        if not texts:
            continue
        rest = TEXT.sub("", branch)
        pattern = r"\w*".join(re.escape(t).replace(r"\{\}", r"\w*") for t in texts)
        if re.search(r"\+\s*\w|\bkey\(", rest):
            pattern = pattern + (r"\w*" if not branch.rstrip().endswith('"') else "")
        if re.match(r"\w+ \+", rest.strip()) and not rest.strip().startswith("key("):
            pattern = r"\w*" + pattern
        found.append(pattern)
    return found


def asked_in(name, text):
    """(pattern of the key, place in the source) of everything that a file asks a config for."""
    text = TOKEN.sub(lambda m: m.group(0) if m.group(0)[0] in "\"'R" else " " * len(m.group(0)), text)
    calls = [m.end() for m in READ.finditer(text)]
    calls += [m.end() for m in HANDED_ON.finditer(text) if m.group(1) not in NOT_OF_KEYS and m.group(1) != "error"]
    for at in calls:
        expression, place = argument(text, at), f"{name}:{text.count(chr(10), 0, at) + 1}"
        if expression in ELSEWHERE:
            where = ELSEWHERE[expression]
            source = (SOURCE / IN_FILE[expression]).read_text() if expression in IN_FILE else text
            for row in re.findall(where, source, re.S) if where else []:
                for line in re.findall(r"\{(\"\w+\")", row) or [row]:  # rows of a table begin with their key
                    yield from ((p, place) for p in patterns_of(line))
        elif expression != '""':  # an error of the whole table
            yield from ((p, place) for p in patterns_of(expression) or [None])


# Files of other kinds that are read with the same reader.
NO_CONFIG = {"app/client/signing_key.cc": "a private key, made by 'trunnion key make' alone",
             "app/lab/wiring.cc": "a drawing of keys that the machine's readers have judged"}


class Source(unittest.TestCase):
    def test_every_key_that_the_source_asks_for(self):
        known = KEYS.names | KEYS.table_names
        patterns = set()
        for name in source_files(".cc", ".h"):
            text = (SOURCE / name).read_text()
            if name.startswith(("tests/", "bench/", "core/config")) or name in NO_CONFIG or "ConfigTable" not in text:
                continue
            for pattern, place in asked_in(name, text):
                self.assertIsNotNone(pattern, f"{place}: this test cannot tell which keys are asked for; teach it")
                hits = [key for key in known if re.fullmatch(pattern, key)]
                self.assertTrue(hits, f"{place}: '{pattern}' is asked for, but no such key is on the page; "
                                "give it a place in app/cli/config_specimen_texts.cc and a meaning")
                patterns.add(pattern)
        unseen = [key for key in KEYS.names if not any(re.fullmatch(pattern, key) for pattern in patterns)]
        self.assertEqual(unseen, [], "no reader was found that asks for these: teach this test how it does")

    def test_the_search_sees_every_way_to_ask(self):
        text = ('x = table.number("a", kPositive); y = t->has("b"); read_word(machine, table, "c");\n'
                'z = io.text("d_" + unit);\n'
                'z = t.number(key("e"), 1); t.number(fmt::format("f{}_mm", k)); t.text(on ? "g" : "h"); t.text(what);\n'
                '// t.text("comment")\nconst char* key = on ? "m_on" : "m_off"; t.has(key);\n')
        self.assertEqual([p for p, _ in asked_in("x.cc", text)],
                         ["a", "b", r"d_\w*", r"e\w*", r"f\w*_mm", "g", "h", None, "m_on", "m_off", "c"])


class Line:
    """One line `key = value` of a config, and how to change it."""

    def __init__(self, path, number, place, row, value):
        self.path, self.number, self.place, self.row, self.value = path, number, place, row, value

    def edited(self, replacement):
        lines = self.path.read_text().splitlines(keepends=True)
        key = self.place[2]
        lines[self.number] = f"{key} = {replacement}\n" if replacement is not None else "\n"
        return "".join(lines)


def headers_of(text):
    """The numbered table that each line of a config belongs to, as "drives.node[1]"."""
    counts, here = {}, ""
    for line in text.splitlines():
        header = re.match(r"(\[\[?)([\w.]+)\]", line)
        if header:
            name = header.group(2)
            if header.group(1) == "[[":
                counts[name] = counts.get(name, -1) + 1
                for inner in [n for n in counts if n.startswith(name + ".")]:
                    del counts[inner]
            parts = name.split(".")
            steps = [".".join(parts[:i + 1]) for i in range(len(parts))]
            here = ".".join(part + (f"[{counts[step]}]" if step in counts else "") for part, step in zip(parts, steps))
        yield here


def lines_of(path):
    """The lines of a config that are one key each, with the rows of the page."""
    text = path.read_text()
    order = {(numbered, key): (table, kind, key, value)
             for table, kind, key, value, numbered in walk(tomllib.loads(text))}
    for number, (line, here) in enumerate(zip(text.splitlines(), headers_of(text))):
        key = re.match(r"(\w+) = [^\[]", line)
        if key:
            table, kind, name, value = order[(here, key.group(1))]
            yield Line(path, number, (table, kind, name), KEYS.row(table, kind, name), value)


def with_defaults(text):
    """The lines of a config, behind every header those of its keys that are missing and have a default."""
    places, present = {}, set()
    for table, kind, key, _, numbered in walk(tomllib.loads(text)):
        places[numbered] = (table, kind)
        present.add((numbered, key))
    for line, here in zip(text.splitlines(), headers_of(text)):
        yield line, False
        if line.startswith("[") and here in places:
            for (table, kind, key), row in KEYS.rows.items():
                if (table, kind) == places[here] and "default" in row and (here, key) not in present:
                    yield f"{key} = {json.dumps(row['default'])}", True


class Behaviour(unittest.TestCase):
    """What the page says of a key is what its reader does."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        shutil.copytree(SOURCE / "configs", cls.folder / "configs")
        (cls.folder / "still.ngc").write_text("G21 G90\nM2\n")
        (cls.folder / "moves.ngc").write_text("G21 G91\nG1 X2 F900\nY1\nX-1 Y1\nG2 X2 I1 J0\nG0 Z1\nM2\n")
        seen = set()
        cls.lines = [line for path in CONFIGS for line in lines_of(path)
                     if line.place not in seen and not seen.add(line.place)]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def answers(self, cases):
        """Exit code and first line for each (line, replacement)."""
        def one(numbered):
            i, (line, replacement) = numbered
            path = self.folder / "configs" / f"case{i}.toml"
            path.write_text(line.edited(replacement))
            code, _, err = trunnion("run", self.folder / "still.ngc", "--machine", path)
            path.unlink()
            return line, replacement, code, (err.splitlines() or [""])[0]
        with ThreadPoolExecutor(min(2, os.cpu_count())) as pool:
            return list(pool.map(one, enumerate(cases)))

    @staticmethod
    def beyond(row, bound):
        """A number outside of this end of the row's range, of the row's form."""
        number = (2 * abs(row[bound]) + 1) * (1 if bound == "max" else -1)
        return int(number) if row["form"] == "integer" else number

    def test_there_are_many_keys_to_try(self):
        self.assertGreater(len(self.lines), 150)

    def test_what_is_out_of_range_is_refused(self):
        cases = []
        for line in self.lines:
            if "max" in line.row:
                cases.append((line, self.beyond(line.row, "max")))
            for bound in ("min", "above"):
                if bound in line.row:
                    cases.append((line, self.beyond(line.row, "min") if bound == "min" else 0))
        self.assertGreater(len(cases), 80)
        for line, wrong, code, message in self.answers(cases):
            self.assertEqual(code, 3, (line.place, wrong, message))
            self.assertRegex(message, rf"{line.place[2]}' = \S+ is out of range", line.place)

    def test_what_is_in_range_is_in_range(self):
        cases = [(line, line.row[bound]) for line in self.lines for bound in ("min", "max") if bound in line.row]
        for line, edge, _, message in self.answers(cases):
            self.assertNotIn(f"{line.place[2]}' = ", message, (line.place, edge))

    def test_other_words_and_forms_are_refused(self):
        wrong = {"choice": ('"nonsense"', "is not legal"), "boolean": ("7", "must be true or false"),
                 "number": ('"x"', "must be a number"), "integer": ("1.5", "must be a whole number"),
                 "text": ("7", "must be a string")}
        for line, _, code, message in self.answers([(line, wrong[line.row["form"]][0]) for line in self.lines]):
            self.assertEqual(code, 3, (line.place, message))
            self.assertIn(wrong[line.row["form"]][1], message, line.place)

    def test_every_word_on_the_page_is_known(self):
        cases = [(line, f'"{word}"') for line in self.lines for word in line.row.get("choices", [])]
        self.assertGreater(len(cases), 30)
        for line, word, _, message in self.answers(cases):
            self.assertNotIn(f"{line.place[2]}' = {word} is not legal", message, line.place)

    def traced(self, name, text):
        """Exit code, first line of the errors and trace of a short program on this config."""
        path, trace = self.folder / "configs" / f"{name}.toml", self.folder / f"{name}.csv"
        path.write_text(text)
        code, _, err = trunnion("run", self.folder / "moves.ngc", "--machine", path, "--trace", trace)
        return code, (err.splitlines() or [""])[0], trace.read_bytes() if code == 0 else b""

    def test_a_default_that_is_spelt_out_changes_no_setpoint(self):
        # A key that goes with another unit of joint or another key is refused by its line: it is left out again.
        for name in ("cradle_measured", "head_screws", "rail_mill_measured", "hexapod", "cradle_can", "mill_modbus"):
            text = (SOURCE / f"configs/{name}.toml").read_text()
            plain = self.traced("plain", text)
            self.assertEqual(plain[0], 0, plain[1])
            lines = list(with_defaults(text))
            while True:
                code, message, trace = self.traced("spelt", "\n".join(line for line, _ in lines))
                refused = re.match(r"[^:]*:(\d+):\d+: unknown key", message)
                if not refused or not lines[int(refused.group(1)) - 1][1]:
                    break
                del lines[int(refused.group(1)) - 1]
            added = sum(new for _, new in lines)
            self.assertEqual(code, 0, (name, message))
            self.assertGreater(added, 30, name)
            self.assertEqual(trace, plain[2], name)

    def test_what_is_required_is_missed_and_nothing_else(self):
        for line, _, code, message in self.answers([(line, None) for line in self.lines]):
            missed = re.search(rf"missing key '[^']*\b{line.place[2]}'|did you mean '{line.place[2]}'", message)
            words = "default_in_words" in line.row
            if line.row["required"] or "one_of" in line.row:
                self.assertEqual(code, 3, (line.place, message))
                self.assertTrue(missed, (line.place, message))
            elif not words:
                self.assertFalse(missed, (line.place, message))


if __name__ == "__main__":
    KEYS = Keys()
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
