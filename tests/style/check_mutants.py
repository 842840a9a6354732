#!/usr/bin/python3
"""Checks that tests/mutants.txt excuses only what scripts/mutate.py could still do: the line stands in the file, the
change is one of its changes, and a reason is given. A row of code that is gone would excuse whatever comes to look
like it. Errors as file:line."""
import sys

from source_text import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
from mutate import describe, mutants_of  # noqa: E402

LIST = "tests/mutants.txt"


def names_of(file):
    """Every change that mutate.py makes in the file, as it would list it."""
    path = ROOT / file
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    return {describe(mutant, text) for mutant in mutants_of(file, text)}


def check(text, names=names_of):
    """Errors of a list; `names` gives the changes of a file."""
    known, errors, seen = {}, [], set()
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        mutant, _, reason = (part.strip() for part in line.rpartition("  # "))
        file = mutant.split(": ")[0]
        if file not in known:
            known[file] = names(file)
        if not mutant or not reason:
            errors.append(f"{LIST}:{number}: no reason; write 'file: code -> code  # why no test can fail'")
        elif mutant not in known[file]:
            errors.append(f"{LIST}:{number}: {file} has no such line any more, or no such change of it; remove the row")
        elif mutant in seen:
            errors.append(f"{LIST}:{number}: stands here twice")
        seen.add(mutant)
    return errors


def main():
    text = (ROOT / LIST).read_text(encoding="utf-8")
    errors = check(text)
    print("\n".join(errors + [f"{sum('  # ' in line for line in text.splitlines())} rows, {len(errors)} errors"]))
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
