#!/usr/bin/python3
"""Builds the documents' site with mkdocs --strict: no warning, every page there, no dead anchor.

    tests/docs/build_site.py        exit code 77 (skipped) without Debian's mkdocs
"""
import re
import shutil
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from pathlib import Path

from pages import ROOT, documents


class Page(HTMLParser):
    """The anchors of a page, and its links to pages of the site."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.links = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        if "id" in found:
            self.anchors.add(found["id"])
        if tag == "a" and not re.match(r"\w+:", found.get("href") or "x:"):
            self.links.append(found["href"])


def dead_anchors(site):
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html") if path.name != "404.html"}
    errors = []
    for path, page in pages.items():
        for link in page.links:
            target, _, anchor = link.partition("#")
            there = (path.parent / target).resolve() if target else path
            there = there / "index.html" if there.is_dir() else there
            if there.suffix == ".html" and there not in pages:
                errors.append(f"{path.relative_to(site)}: there is no '{link}'")
            elif anchor and there in pages and anchor not in pages[there].anchors:
                errors.append(f"{path.relative_to(site)}: '{link}' has no such heading")
    return errors


def main():
    mkdocs = shutil.which("mkdocs")
    if not mkdocs:
        print("skipped: there is no mkdocs (apt-get install mkdocs)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        build = subprocess.run([mkdocs, "build", "--strict", "--quiet", "--config-file", str(ROOT / "mkdocs.yml"),
                                "--site-dir", folder], capture_output=True, text=True, cwd=ROOT)
        errors = [build.stdout + build.stderr] if build.returncode or build.stderr.strip() else []
        pages = len(list(Path(folder).rglob("index.html")))
        errors += dead_anchors(Path(folder).resolve())
        if pages < len(documents()):
            errors.append(f"{pages} pages of {len(documents())} documents")
        print("\n".join(errors + [f"{pages} pages"]))
        return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
