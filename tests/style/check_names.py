#!/usr/bin/python3
"""Checks that the names and files in the documents' backticks are in the source. Errors as file:line."""
import fnmatch
import re
import sys

from source_text import ROOT, TOKEN, source_files

SPAN = re.compile(r"`([^`]+)`")
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
WORD = re.compile(r"[A-Za-z_]\w*")

QUALIFIED = re.compile(r"(?:\w+::)*(\w+)(?:::|(?<=_t)\.)(\w+)(?:\(\))?$")  # Class::name, message_t.field
SINGLE = re.compile(r"[A-Z]\w*[a-z]\w*$|k[A-Z]\w*$|TRN_\w+$|\w+\(\)$|[a-z]\w*_\w+$")  # Name, kName, name(), a_name
PATH = re.compile(r"[\w.*-]+(?:/[\w.*-]+)*/?$")
FILE_ENDS = (".h", ".cc", ".py", ".sh", ".md", ".ngc", ".lcm")
PLACEHOLDER = re.compile(r"(^|/)[A-Z]+\.\w+$")  # configs/X.toml


class Tree:
    """What the repository has: names of files and folders, and the words of every header with its source."""

    def __init__(self, texts):
        """`texts`: file name to text, of every file that a document may speak of."""
        self.files = set(texts)
        self.folders = {name[:at] for name in texts for at, char in enumerate(name) if char == "/"}
        self.tops = {name.split("/")[0] for name in self.folders}
        self.units = {}
        for name, text in texts.items():
            stem = name.rsplit(".", 1)[0]
            self.units.setdefault(stem, set()).update(words_of(name, text), [stem.split("/")[-1]])
        self.words = set().union(*self.units.values())

    def has_path(self, path):
        known = self.folders if path.endswith("/") else self.files | self.folders
        path = path.removeprefix("./").rstrip("/")
        if path.split("/")[0] in self.tops:
            return path in known or any(fnmatch.fnmatchcase(name, path) for name in known)
        return any(name == path or name.endswith("/" + path) for name in known)

    def has_pair(self, owner, member):
        return any(owner in words and member in words for words in self.units.values())


def words_of(name, text):
    """The words of a file; of C++ without its comments, where a dead name lives on."""
    if name.endswith(".md"):
        return set()
    if name.endswith((".h", ".cc")):
        text = TOKEN.sub(lambda match: " " if match.group(0).startswith("/") else match.group(0), text)
    return set(WORD.findall(text))


def dead(span, tree):
    """What the text between two backticks names and the tree has not."""
    if " " in span:  # a command or a formula: only the files in it
        return [word for word in span.split() if names_path(word, tree, True) and not tree.has_path(word)]
    if names_path(span, tree, False):
        return [] if tree.has_path(span) else [span]
    match = QUALIFIED.match(span)
    if match and match.group(1) != "std":
        return [] if tree.has_pair(*match.groups()) else [span]
    return [span] if SINGLE.match(span) and span.removesuffix("()") not in tree.words else []


def names_path(text, tree, in_command):
    """Whether `text` is meant as a file or folder of ours."""
    if not PATH.match(text) or PLACEHOLDER.search(text) or text.strip(".*") in ("h", "cc", "lcm", "toml"):
        return False
    if "/" in text and text.split("/")[0] in tree.tops:
        return True
    return not in_command and (text.endswith("/") or text.endswith(FILE_ENDS))


def check(path, text, tree):
    text = FENCE.sub(lambda match: "\n" * match.group(0).count("\n"), text)
    errors = []
    for match in SPAN.finditer(text):
        number = text.count("\n", 0, match.start()) + 1
        span = " ".join(match.group(1).split())
        errors += [f"{path}:{number}: '{name}' is not in the source; mend the name" for name in dead(span, tree)]
    return errors


def main():
    names = [name for name in source_files("") if not name.startswith("tests/style/check_names")]
    texts = {name: "" if "tests/style/" in name else (ROOT / name).read_text(errors="replace") for name in names}
    tree = Tree(texts)
    documents = [name for name in names if re.match(r"(README|CHANGELOG|CONTRIBUTING|docs/[^/]+)\.md$", name)]
    errors = [error for name in documents for error in check(name, texts[name], tree)]
    print("\n".join(errors + [f"{len(documents)} documents, {len(errors)} errors"]))
    return 1 if errors or not documents else 0


if __name__ == "__main__":
    sys.exit(main())
