#!/usr/bin/python3
"""Tells what the source is like, folder by folder: size, functions, comments, checks, tests, includes.

usage: scripts/house_figures.py [--commit REV] [--json]

  scripts/house_figures.py                      of this tree, as it is
  scripts/house_figures.py --commit 5c27a6b     of a commit, for a before beside an after

What a column counts:
  files, lines   C++ sources and headers
  functions      with a body; their length in lines, header to closing brace: median, 95 of 100, longest
  comment        lines that hold nothing but a comment, in percent
  checks         TRN_CHECK, which stay on in the released build
  units, tested  a header with its source is one unit; tested: some tests/**/UNIT_test.cc has its name
  out, in        includes of other folders' headers, and of this folder's headers by others (without tests)

Exit codes: 0 done, 1 no such commit, 5 usage.
"""
import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/style"))
from source_text import code_only, functions  # noqa: E402

# These have rooms of their own inside; every other top folder is one.
BUILDINGS = ("app", "interp", "panel")
ROOMS = ("kernel/rate", "compensation/fit")
BESIDE = ("tests", "bench")  # told below the product's sum
LEFT_OUT = ("cmake", "examples", "build", "out")
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)
CHECK = re.compile(r"\bTRN_CHECK\s*\(")
COLUMNS = ("files", "lines", "functions", "median", "p95", "longest", "comment", "checks", "units", "tested", "out",
           "in")


def folder_of(name):
    parts = name.split("/")
    if "/".join(parts[:2]) in ROOMS or parts[0] in BUILDINGS and len(parts) > 2:
        return "/".join(parts[:2])
    return parts[0]


def sources(tree):
    """C++ files by name, with their text."""
    files = (path for suffix in ("*.cc", "*.h") for path in tree.rglob(suffix))
    named = ((str(path.relative_to(tree)), path) for path in files)
    return {name: path.read_text(encoding="utf-8") for name, path in sorted(named)
            if "/" in name and name.split("/")[0] not in LEFT_OUT}


def comment_lines(text):
    """Lines with nothing but a comment."""
    inside, count = False, 0
    for line in text.splitlines():
        line = line.strip()
        begins = line.startswith("/*")
        count += inside or begins or line.startswith("//")
        inside = (inside or begins) and "*/" not in line
    return count


def share(lengths, part):
    """The least length that so much of all do not exceed; 0 of none."""
    return sorted(lengths)[math.ceil(part * len(lengths)) - 1] if lengths else 0


def edges(files):
    """(folder that includes, folder included) of each line that crosses a border; tests and benchmarks left out."""
    out = []
    for name, text in files.items():
        own = folder_of(name)
        if own in BESIDE:
            continue
        for target in INCLUDE.findall(text):
            # beside the including file, or named from the top folder; what is generated counts for none
            if target in files and folder_of(target) != own:
                out.append((own, folder_of(target)))
    return out


def figures(files, crossing, tested_stems):
    """The row of some files; `crossing`: the edges out of and into them."""
    texts = files.values()
    lines = sum(len(text.splitlines()) for text in texts)
    lengths = [function.length for text in texts for function in functions(code_only(text))]
    units = {name.rsplit(".", 1)[0] for name in files}
    return {"files": len(files), "lines": lines, "functions": len(lengths), "median": share(lengths, 0.5),
            "p95": share(lengths, 0.95), "longest": max(lengths, default=0),
            "comment": round(100 * sum(map(comment_lines, texts)) / max(lines, 1), 1),
            "checks": sum(len(CHECK.findall(code_only(text))) for text in texts), "units": len(units),
            "tested": sum(Path(unit).name in tested_stems for unit in units), "out": crossing[0], "in": crossing[1]}


def table(tree):
    """Rows by folder, then "product", then tests and benchmarks."""
    files = sources(tree)
    crossing = edges(files)
    tested = {Path(name).stem.removesuffix("_test") for name in files
              if name.startswith("tests/") and name.endswith("_test.cc")}
    folders = sorted({folder_of(name) for name in files})
    product = [folder for folder in folders if folder not in BESIDE]
    rows = {}
    for folder in product + ["product"] + [folder for folder in folders if folder in BESIDE]:
        own = {name: text for name, text in files.items()
               if folder_of(name) == folder or folder == "product" and folder_of(name) in product}
        both = ((len(crossing),) * 2 if folder == "product" else
                (sum(a == folder for a, _ in crossing), sum(b == folder for _, b in crossing)))
        rows[folder] = figures(own, both, tested)
    for folder in BESIDE:  # they are no units that a test is named after
        for column in ("units", "tested", "out", "in"):
            rows.get(folder, {}).pop(column, None)
    return rows


def text_of(rows):
    """A table in Markdown."""
    out = ["| folder | " + " | ".join(COLUMNS) + " |", "|---|" + "---:|" * len(COLUMNS)]
    out += [f"| {folder} | " + " | ".join(f"{row[c]:,}" if c in row else "" for c in COLUMNS) + " |"
            for folder, row in rows.items()]
    return "\n".join(out)


def of_commit(commit):
    """The table of a commit, or None if there is no such commit."""
    archive = subprocess.run(["git", "-C", ROOT, "archive", commit], capture_output=True)
    if archive.returncode:
        return None
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
        return table(Path(folder))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commit", help="look at this commit instead of the tree")
    parser.add_argument("--json", action="store_true", help="print one JSON object, a key for each folder")
    options = parser.parse_args()
    rows = of_commit(options.commit) if options.commit else table(ROOT)
    if rows is None:
        print(f"{options.commit}: git has no such commit here", file=sys.stderr)
        return 1
    print(json.dumps(rows, indent=1) if options.json else text_of(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
