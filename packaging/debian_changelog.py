#!/usr/bin/env python3
"""Prints Debian's changelog of the packages: debian_changelog.py CHANGELOG.md MAINTAINER

An entry for each dated version; what changed stands in the upstream changelog beside it.
"""
import datetime
import re
import sys


def entry(version, day, maintainer):
    date = datetime.datetime.fromisoformat(day).strftime("%a, %d %b %Y 12:00:00 +0000")
    return (f"trunnion ({version}-1) unstable; urgency=medium\n\n  * Version {version}.\n\n"
            f" -- {maintainer}  {date}\n")


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        versions = re.findall(r"^## \[(\d[\w.]*)\] - (\d{4}-\d\d-\d\d)$", file.read(), re.M)
    print("\n".join(entry(version, day, sys.argv[2]) for version, day in versions), end="")


main()
