#!/usr/bin/python3
"""Checks that the documents' links to files of the repository lead somewhere. Errors as file:line."""
import re
import sys

from source_text import ROOT, source_files

LINK = re.compile(r"\]\((?!\w+:)([^)#\s]+)[^)]*\)")


def check(path, text, there):
    """`there`: whether a file of the repository, or a folder that has any, goes by this name."""
    errors = []
    for number, line in enumerate(text.split("\n"), 1):
        for link in LINK.findall(line):
            try:
                name = str(((ROOT / path).parent / link).resolve().relative_to(ROOT))
            except ValueError:
                errors.append(f"{path}:{number}: '{link}' leads out of the repository")
                continue
            if not there(name):
                errors.append(f"{path}:{number}: there is no '{link}'; add it, or mend the link")
    return errors


def main():
    names = source_files("")
    known = set(names) | {parent for name in names for parent in folders(name)}
    documents = [name for name in names if name.endswith(".md")]
    errors = [error for name in documents for error in check(name, (ROOT / name).read_text(), known.__contains__)]
    print("\n".join(errors + [f"{len(documents)} documents"]))
    return 1 if errors else 0


def folders(name):
    parts = name.split("/")
    return ["/".join(parts[:n]) for n in range(1, len(parts))]


if __name__ == "__main__":
    sys.exit(main())
