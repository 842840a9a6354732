#!/usr/bin/python3
"""Writes docs/faults.md from the table in core/fault.cc. --check: writes nothing and fails if the page is stale."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "faults.md"

REACTIONS = {
    "kNone": "nothing; it is reported",
    "kPathStop": "all joints stop together on the path, within their limits; the drives stay on",
    "kQuickStop": "each drive brakes by its own ramp, then loses power",
}

HEAD = """# Faults

A fault stays on show until `trunnion reset`, and nearly every one stops the machine. For example, a joint that is
blocked lags behind its setpoint. The drives brake, `trunnion status` shows `following_error` with the joint, and the
program is given up. Free the axis, then reset.

Where several faults come together, the first one is shown, unless a later one asks for a stronger reaction.
`python3 docs/make_faults.py` writes this page from the table in `core/fault.cc`; a test compares the two.

| fault | what it means | what the machine does | what to do |
|---|---|---|---|
"""

STRINGS = re.compile(r'"((?:[^"\\]|\\.)*)"')
ROW = re.compile(r"\{Fault::(k\w+),\s*\{(.*?)\}\},?\n", re.S)


def joined(text):
    """The string literals of `text`; neighbours without a comma between are one string."""
    return STRINGS.findall(re.sub(r'"\s*"', "", text))


def sentence(text):
    return text[:1].upper() + text[1:] + "." if text else ""


def page(source):
    table = source[source.index("kFaults = {{"):source.index("\n}};")] + "\n"
    rows = []
    for name, body in ROW.findall(table):
        if name == "kOk":
            continue
        reaction = re.search(r"Reaction::(k\w+)", body).group(1)
        strings = joined(body)
        if len(strings) != 3:
            sys.exit(f"core/fault.cc: the row of {name} has {len(strings)} texts, not name, meaning and remedy")
        cells = [f"`{strings[0]}`", *map(sentence, (strings[1], REACTIONS[reaction], strings[2]))]
        rows.append("| " + " | ".join(cells) + " |")
    return HEAD + "\n".join(rows) + "\n", len(rows)


def main():
    text, count = page((ROOT / "core" / "fault.cc").read_text())
    if "--check" in sys.argv[1:]:
        stale = not PAGE.exists() or PAGE.read_text() != text
        print("docs/faults.md:1: stale; run python3 docs/make_faults.py" if stale else f"{count} faults, up to date")
        return 1 if stale or count == 0 else 0
    PAGE.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
