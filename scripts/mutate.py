#!/usr/bin/python3
"""Shows where tests are blind: changes one operator, bound or constant at a time, and runs the tests of that folder.

usage: scripts/mutate.py FOLDER [--count N] [--seed N] [--jobs N] [--keep DIR]

  scripts/mutate.py hal/can --count 50          fifty changes in hal/can, judged by test_hal
  scripts/mutate.py kernel/path_rate.cc         of one file

Works in a copy of the last commit, never in your tree. Each mutant is compiled and the folder's test program run with
five times the time that it takes unchanged. A mutant that no test fails lives: either a test is missing, or the change
makes no difference. Those of the second kind are listed with the reason in tests/mutants.txt, as `file: code -> code`.

Exit codes: 0 no unknown mutant lives, 1 some do, 2 the tests fail unchanged, 5 usage.
"""
import argparse
import random
import re
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
ALSO = {"hal": ["test_sim"]}  # the field that is emulated is what most of hal/ is tested against


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
        subprocess.run(["git", "-C", ROOT, "worktree", "add", "--detach", "--force", folder, "HEAD"], check=True,
                       capture_output=True)
        subprocess.run(["cmake", "--preset", "release"], cwd=folder, check=True, capture_output=True)

    def close(self):
        subprocess.run(["git", "-C", ROOT, "worktree", "remove", "--force", self.folder], check=False)

    def build(self, programs):
        command = ["ninja", "-C", "build/release", "-j", str(self.jobs), *programs]
        return subprocess.run(command, cwd=self.folder, capture_output=True).returncode == 0

    def passes(self, programs, limit_s):
        """Whether every program passes in time, and how long they took."""
        begin = time.monotonic()
        for program in programs:
            try:
                done = subprocess.run([f"build/release/{program}", "--gtest_brief=1", "--gtest_fail_fast"],
                                      cwd=self.folder, capture_output=True, timeout=limit_s)
            except subprocess.TimeoutExpired:
                return False, limit_s
            if done.returncode != 0:
                return False, time.monotonic() - begin
        return True, time.monotonic() - begin


def judge(copy, mutant, programs, limit_s):
    path = copy.folder / mutant.file
    text = path.read_text(encoding="utf-8")
    path.write_text(text[:mutant.at] + mutant.after + text[mutant.at + len(mutant.before):], encoding="utf-8")
    try:
        if not copy.build(programs):
            return "does not compile"
        return "lives" if copy.passes(programs, limit_s)[0] else "killed"
    finally:
        path.write_text(text, encoding="utf-8")


def chosen(target, count, seed):
    files = [ROOT / target] if (ROOT / target).is_file() else sorted((ROOT / target).rglob("*.cc"))
    names = [str(path.relative_to(ROOT)) for path in files]
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in names}
    every = [mutant for name in names for mutant in mutants_of(name, texts[name])]
    random.Random(seed).shuffle(every)
    return every[:count], len(every), texts


def run(options):
    folder = max((f for f in PROGRAMS if options.target.startswith(f)), key=len)
    programs = [PROGRAMS[folder], *ALSO.get(folder, [])]
    mutants, possible, texts = chosen(options.target, options.count, options.seed)
    print(f"{len(mutants)} of {possible} mutants of {options.target}, judged by {', '.join(programs)}", flush=True)
    known, alive, tally = known_equivalents(), [], {}
    with tempfile.TemporaryDirectory(dir=options.keep) as place:
        copy = Copy(f"{place}/tree", options.jobs)
        try:
            good, took_s = copy.passes(programs, 3600) if copy.build(programs) else (False, 0)
            if not good:
                print("the tests fail without any change", file=sys.stderr)
                return 2
            for number, mutant in enumerate(mutants, 1):
                text = texts[mutant.file]
                verdict, name = judge(copy, mutant, programs, 20 + 5 * took_s), describe(mutant, text)
                if verdict == "lives" and name in known:
                    verdict = "lives, as listed"
                tally[verdict] = tally.get(verdict, 0) + 1
                print(f"{number:4} {verdict:17} {mutant.file}:{mutant.line(text)} {name.split(': ', 1)[1]}", flush=True)
                alive += [name] if verdict == "lives" else []
        finally:
            copy.close()
    print(", ".join(f"{count} {verdict}" for verdict, count in sorted(tally.items())))
    return 1 if alive else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", help="a folder of the source, or one file")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", default=None, help="where the copy is made (default: the system's temporary folder)")
    options = parser.parse_args()
    if not (ROOT / options.target).exists() or not any(options.target.startswith(f) for f in PROGRAMS):
        print(f"{options.target}: no folder with a test program of its own; those are {', '.join(PROGRAMS)}",
              file=sys.stderr)
        return 5
    return run(options)


if __name__ == "__main__":
    sys.exit(main())
