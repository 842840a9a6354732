#!/usr/bin/python3
"""Shows where tests are blind: changes one operator, bound or constant at a time, and runs the tests of that folder.

usage: scripts/mutate.py FOLDER [--count N] [--seed N] [--skip FILE] [--jobs N] [--keep DIR]
                               [--results FILE | --only FILE]

  scripts/mutate.py hal/can --count 50          fifty changes in hal/can, judged by test_hal, then by test_sim
  scripts/mutate.py kernel/path_rate.cc         of one file
  scripts/mutate.py hal --results hal.jsonl     writes every verdict down; a second call goes on from there
  scripts/mutate.py hal --only hal.jsonl        those that lived, once more, after tests were committed

Works in a copy of the last commit, never in your tree. Each mutant is compiled, and judged first by the tests
that have the file's name, then by the folder's quick tests, then by the slow ones, in app/daemon and app/lab
also by scripts that run the whole program. Each may take five times as long as unchanged. A mutant that no test
fails lives: either a test is missing, or the change makes no difference. Those of the second kind are listed with
the reason in tests/mutants.txt, as `file: code -> code`.

How long the tests take unchanged is measured first. A kept copy remembers that for programs as they were.

Exit codes: 0 no unknown mutant lives, 1 some do, 2 the tests fail or do not compile unchanged, 5 usage.
"""
import argparse
import hashlib
import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/style"))
from source_text import code_only, functions  # noqa: E402

# Text, and what may stand in its place; longer ones first.
CHANGES = [("<=", ["<"]), (">=", [">"]), ("==", ["!="]), ("!=", ["=="]), ("&&", ["||"]), ("||", ["&&"]),
           ("+=", ["-="]), ("-=", ["+="]), ("*=", ["/="]), ("/=", ["*="]), ("++", ["--"]), ("--", ["++"]),
           (" < ", [" <= ", " > "]), (" > ", [" >= ", " < "]), (" + ", [" - "]), (" - ", [" + "]),
           (" * ", [" / "]), (" / ", [" * "]), ("std::min(", ["std::max("]), ("std::max(", ["std::min("]),
           ("true", ["false"]), ("false", ["true"]), ("return -", ["return "])]
NUMBER = re.compile(r"(?<![\w.])(\d+\.?\d*(?:e-?\d+)?)(?![\w.])")
# The test program of a folder; the longest name that fits.
PROGRAMS = {"core": "test_core", "interp/gcode": "test_interp_gcode", "interp/plan": "test_interp_plan",
            "kinematics": "test_kinematics", "compensation": "test_compensation", "hal": "test_hal", "sim": "test_sim",
            "kernel": "test_kernel", "app/session": "test_app_session", "app/daemon": "test_app_daemon",
            "app/check": "test_app_check", "app/lab": "test_app_lab"}
QUICK_SHARE = 0.1  # of the time of all tests: what the quick ones together may take
MEMORY_BYTES = 4 << 30
# The field that is emulated is what most of hal/ is tested against, and whole runs test the tick.
ALSO = {"hal": ["test_sim"], "kernel": ["test_app_session"]}
# Slow tests that no mutant there can reach, or that repeat on every machine what two machines show.
BLIND = {"hal/can": re.compile("Modbus|Indexer|Cabinet"),
         "kernel": re.compile(r"(HoldIsNear|NeverAllocates|OperatorEvents|EveryMachineRuns)\w*/(?!cradle$|mill$)"
                              "|ProgramFuzz|ScrewWarmUp|Drilling|RunPromises|Corrections[.]|HexapodRuns")}
# What the whole program shows and no part of it: these scripts of tests/ judge last.
SCRIPTS = {"app/daemon": ["app/daemon/state_e2e", "app/daemon/operator_e2e", "app/daemon/jog_e2e",
                          "app/daemon/pause_e2e", "app/daemon/resume_e2e", "app/daemon/daemon_e2e",
                          "app/daemon/scope_e2e"],
           "app/lab": ["app/cli/workspace_command", "app/cli/ball_command", "app/cli/commission_command"]}
SHARDS = {"test_sim": 4}  # its slow tests wait for time-outs: they may do so together


@dataclass
class Mutant:
    file: str
    at: int
    before: str
    after: str

    def line(self, text):
        return text.count("\n", 0, self.at) + 1


def places(text):
    """Offsets within function bodies, checks that stay on and static checks left out."""
    code = code_only(text)
    if len(code) != len(text):  # comments and strings are blanked to their lines only: work on a padded copy
        code = padded(text)
    spans = []
    at = 0
    for function in functions(code):
        begin = code.find(function.body, at)
        spans.append((begin, begin + len(function.body)))
        at = max(at, begin)
    return code, spans


def padded(text):
    """The code with comments, strings and preprocessor lines as blanks: every offset is that of the text."""
    words = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"'
    out = re.sub(words, lambda m: re.sub(r"[^\n]", " ", m.group(0)), text, flags=re.S)
    return re.sub(r"^[ \t]*#[^\n]*", lambda m: " " * len(m.group(0)), out, flags=re.M)


def other_number(digits):
    value = float(digits)
    if value == 0:
        return "1"
    return repr(value * 2) if "." in digits or "e" in digits else str(int(value) + 1)


def mutants_of(file, text):
    code, spans = places(text)
    code = re.sub(r"(?:TRN_CHECK|static_assert)\([^;]*;", lambda m: " " * len(m.group(0)), code)
    out = []
    for begin, end in spans:
        taken = set()
        for old, news in CHANGES:
            for match in re.finditer(re.escape(old), code[begin:end]):
                at = begin + match.start()
                if taken & set(range(at, at + len(old))) or (old.isalpha() and re.match(r"\w", code[at - 1])):
                    continue
                taken |= set(range(at, at + len(old)))
                out += [Mutant(file, at, old, new) for new in news]
        for match in NUMBER.finditer(code[begin:end]):
            out.append(Mutant(file, begin + match.start(), match.group(1), other_number(match.group(1))))
    return out


def known_equivalents():
    path = ROOT / "tests/mutants.txt"
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    return {line.split("#")[0].strip() for line in lines if line.strip() and not line.startswith("#")}


def source_line(text, at):
    begin = text.rfind("\n", 0, at) + 1
    return text[begin:text.find("\n", at)]


def describe(mutant, text):
    """`file: code -> code`, without the line's number, so that the list does not go stale with every edit."""
    before = source_line(text, mutant.at).strip()
    changed = text[:mutant.at] + mutant.after + text[mutant.at + len(mutant.before):]
    return f"{mutant.file}: {before} -> {source_line(changed, mutant.at).strip()}"


class Copy:
    """A worktree of the last commit with a build of its own."""

    def __init__(self, folder, jobs):
        self.folder, self.jobs = Path(folder), jobs
        if (self.folder / "build").is_dir():  # of an earlier run: everything that did not change is built
            head = subprocess.check_output(["git", "-C", ROOT, "rev-parse", "HEAD"], text=True).strip()
            command = ["git", "-C", self.folder, "checkout", "--force", "--detach", head]
        else:
            command = ["git", "-C", ROOT, "worktree", "add", "--detach", "--force", self.folder, "HEAD"]
        subprocess.run(command, check=True, capture_output=True)
        subprocess.run(["cmake", "--preset", "release", "-DTRN_UNITY=OFF"], cwd=folder, check=True, capture_output=True)

    def close(self):
        subprocess.run(["git", "-C", ROOT, "worktree", "remove", "--force", self.folder], check=False)

    def build(self, programs):
        command = ["ninja", "-C", "build/release", "-j", str(self.jobs), *programs]
        return subprocess.run(command, cwd=self.folder, capture_output=True).returncode == 0

    def passes(self, program, limit_s, options, shards=1):
        command = [f"build/release/{program}", "--gtest_brief=1", *options]
        running = [subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                    env=os.environ | {"GTEST_TOTAL_SHARDS": str(shards), "GTEST_SHARD_INDEX": str(n)},
                                    preexec_fn=limit_memory) for n in range(shards)]
        try:
            return all([process.wait(limit_s) == 0 for process in running])
        except subprocess.TimeoutExpired:
            return False
        finally:
            for process in running:
                process.kill()
                process.wait()

    def script_s(self, script):
        """How long a script takes; None if it fails or cannot run here."""
        begin = time.monotonic()
        return time.monotonic() - begin if self.script_passes(script, 3600) else None

    def script_passes(self, script, limit_s):
        program = self.folder / "build/release/trunnion"
        command = ["/usr/bin/python3", f"tests/{script}.py", program, self.folder]
        process = subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   start_new_session=True)
        try:
            return process.wait(limit_s) == 0
        except subprocess.TimeoutExpired:
            return False
        finally:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()

    def durations_s(self, program):
        """Every test's duration, by its full name; None if one fails."""
        with tempfile.NamedTemporaryFile(suffix=".json") as report:
            if not self.passes(program, 3600, [f"--gtest_output=json:{report.name}"]):
                return None
            suites = json.load(open(report.name, encoding="utf-8"))["testsuites"]
        return {f"{suite['name']}.{test['name']}": float(test["time"].rstrip("s"))
                for suite in suites for test in suite["testsuite"] if test["status"] == "RUN"}


def limit_memory():
    """A mutant that never ends its loop must not take the host's memory."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))


def stages(durations_s, file):
    """The tests in the order in which they judge a mutant of the file: by name, quick ones, slow ones."""
    stem = Path(file).stem.replace("_", "")
    blind = next((tests for folder, tests in BLIND.items() if file.startswith(folder)), re.compile("(?!)"))
    durations_s = {test: time_s for test, time_s in durations_s.items() if not blind.search(test)}
    named = [test for test in durations_s if stem in test.split(".")[0].lower()]
    quick, rest = [], []
    left_s = QUICK_SHARE * sum(durations_s.values())
    for test in sorted(set(durations_s) - set(named), key=durations_s.get):
        left_s -= durations_s[test]
        (quick if left_s >= 0 else rest).append(test)
    return [stage for stage in (named, quick, rest) if stage]


def killer(copy, file, programs, scripts):
    """The program that fails, and which of its stages, or the script; None if all pass.

    programs: the durations of each program's tests. scripts: how long each of them takes.
    """
    for program, durations_s in programs.items():
        for number, tests in enumerate(stages(durations_s, file)):
            limit_s = 5 + 5 * sum(durations_s[test] for test in tests)
            with tempfile.NamedTemporaryFile("w", suffix=".flags") as flags:
                flags.write("--gtest_filter=" + ":".join(tests))
                flags.flush()
                shards = SHARDS.get(program, 1) if number else 1
                options = [f"--gtest_flagfile={flags.name}", "--gtest_fail_fast"]
                if copy.passes(program, limit_s, options, shards):
                    continue
                # Tests that wait for answers may fail on a busy host: only what they fail alone too counts.
                if program not in SHARDS or not copy.passes(program, limit_s, options):
                    return f"{program}, stage {number}"
    for script, duration_s in scripts.items():
        # What waits for answers may fail on a busy host: only what fails twice counts.
        if not any(copy.script_passes(script, 20 + 5 * duration_s) for _ in range(2)):
            return script
    return None


def judge(copy, mutant, programs, scripts):
    path = copy.folder / mutant.file
    text = path.read_text(encoding="utf-8")
    path.write_text(text[:mutant.at] + mutant.after + text[mutant.at + len(mutant.before):], encoding="utf-8")
    try:
        if not copy.build([*programs, *(["trunnion"] if scripts else [])]):
            return "does not compile", None
        by = killer(copy, mutant.file, programs, scripts)
        return ("killed" if by else "lives"), by
    finally:
        path.write_text(text, encoding="utf-8")


def every_mutant(root, target, skip):
    """All mutants of the target with their names. Equal changes of equal lines are told apart by a number."""
    files = [root / target] if (root / target).is_file() else sorted((root / target).rglob("*.cc"))
    out, seen = [], {}
    names = sorted(str(path.relative_to(root)) for path in files)
    for name in names:
        if any(name == left or name.startswith(f"{left}/") for left in skip):
            continue
        text = (root / name).read_text(encoding="utf-8")
        for mutant in mutants_of(name, text):
            code = describe(mutant, text)
            seen[code] = seen.get(code, 0) + 1
            out.append((mutant, code, seen[code], mutant.line(text)))
    return out


def recorded(path):
    """The last verdict on every mutant of a file of results, by its name and number."""
    if path is None or not Path(path).is_file():
        return {}
    lines = [json.loads(line) for line in Path(path).read_text(encoding="utf-8").splitlines()]
    return {(line["mutant"], line["number"]): line["verdict"] for line in lines}


def chosen(root, options):
    every = every_mutant(root, options.target, options.skip)
    if options.only:
        alive = [key for key, verdict in recorded(options.only).items() if verdict == "lives"]
        return [entry for entry in every if (entry[1], entry[2]) in alive], len(every)
    total = len(every)
    random.Random(options.seed).shuffle(every)
    done = recorded(options.results)
    return [entry for entry in every[:options.count] if (entry[1], entry[2]) not in done], total


def measured(copy, names, scripts):
    """The durations of the programs' tests and of the scripts. A kept copy knows those of programs as they were."""
    record = copy.folder.parent / "durations.json"
    known = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else {}

    def once(name, files, measure):
        content = hashlib.sha256(b"".join((copy.folder / file).read_bytes() for file in files)).hexdigest()
        duration = known.get(name + content) or measure(name)
        known[name + content] = duration
        return duration

    programs = {name: once(name, [f"build/release/{name}"], copy.durations_s) for name in names}
    scripts = {name: once(name, ["build/release/trunnion", f"tests/{name}.py"], copy.script_s) for name in scripts}
    record.write_text(json.dumps(known), encoding="utf-8")
    return programs, scripts


def judge_all(copy, options):
    folder = max((f for f in PROGRAMS if options.target.startswith(f)), key=len)
    names = [PROGRAMS[folder], *ALSO.get(folder, [])]
    scripts = SCRIPTS.get(folder, [])
    if not copy.build([*names, *(["trunnion"] if scripts else [])]):
        print("the last commit does not compile: ninja -C build/release says where", file=sys.stderr)
        return 2
    programs, scripts = measured(copy, names, scripts)
    failing = [name for name, duration in (programs | scripts).items() if duration is None]
    if failing:
        print(f"without any change these fail: {', '.join(failing)}", file=sys.stderr)
        return 2
    mutants, possible = chosen(copy.folder, options)
    judges = ", ".join([*names, *scripts])
    print(f"{len(mutants)} of {possible} mutants of {options.target}, judged by {judges}", flush=True)
    known, tally = known_equivalents(), {}
    for count, (mutant, name, number, line) in enumerate(mutants, 1):
        verdict, by = judge(copy, mutant, programs, scripts)
        if verdict == "lives" and name in known:
            verdict = "lives, as listed"
        tally[verdict] = tally.get(verdict, 0) + 1
        print(f"{count:4} {verdict:17} {mutant.file}:{line} {name.split(': ', 1)[1]}", flush=True)
        if options.results or options.only:
            entry = {"mutant": name, "number": number, "line": line, "verdict": verdict, "by": by}
            with open(options.only or options.results, "a", encoding="utf-8") as results:
                results.write(json.dumps(entry) + "\n")
    print(", ".join(f"{count} {verdict}" for verdict, count in sorted(tally.items())))
    return 1 if "lives" in tally else 0


def run(options):
    if options.keep:
        return judge_all(Copy(Path(options.keep).resolve() / "tree", options.jobs), options)
    with tempfile.TemporaryDirectory() as place:
        copy = Copy(f"{place}/tree", options.jobs)
        try:
            return judge_all(copy, options)
        finally:
            copy.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", help="a folder of the source, or one file")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--skip", action="append", default=[], help="a file or folder left out; may be repeated")
    parser.add_argument("--keep", help="the copy is made there and stays, so that the next run finds it built")
    parser.add_argument("--results", help="verdicts are added to this file, and those in it are not judged again")
    parser.add_argument("--only", help="judges those again that live by this file of results, and adds the verdicts")
    options = parser.parse_args()
    if not (ROOT / options.target).exists() or not any(options.target.startswith(f) for f in PROGRAMS):
        print(f"{options.target}: no folder with a test program of its own; those are {', '.join(PROGRAMS)}",
              file=sys.stderr)
        return 5
    return run(options)


if __name__ == "__main__":
    sys.exit(main())
