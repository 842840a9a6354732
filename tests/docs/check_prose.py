#!/usr/bin/python3
"""Checks that no sentence of the documents has more than 25 words. Errors as file:line.

    tests/docs/check_prose.py [PAGE...]     --table: median, worst and sentences of each page

A sentence of 40 words is read twice, and beside a machine nobody has time for that. Code, tables, headings and
formulas do not count; a name or command in backticks is one word, a link is its text.
"""
import statistics
import sys

from pages import ROOT, documents, paragraphs, sentences, words

WORDS_MAX = 25


def measure(text):
    """(line, words) of every sentence; the line is that on which its paragraph begins."""
    return [(line, words(sentence)) for line, paragraph in paragraphs(text) for sentence in sentences(paragraph)
            if words(sentence)]


def check(page, text):
    return [f"{page}:{line}: {len(found)} words: '{' '.join(found[:9])} ...'; make it two sentences"
            for line, found in measure(text) if len(found) > WORDS_MAX]


def check_the_check():
    """What the rule must refuse, and must let pass."""
    long = " ".join(["word"] * (WORDS_MAX + 1))
    assert check("p", f"A line.\n\nHere {long}.\n")
    assert check("p", f"- an item that\n  goes on {long}\n")
    assert check("p", f"[{long}](page.md)\n")
    assert not check("p", f"# {long}\n\n| {long} |\n\n```\n{long}\n```\n\n    {long}\n")
    assert not check("p", f"Short `{long}` one. And {' '.join(['word'] * 20)}. Then on.\n")
    assert not check("p", f"<!-- {long} -->\n")


def main():
    check_the_check()
    pages = [argument for argument in sys.argv[1:] if argument != "--table"] or documents()
    texts = {page: (ROOT / page).read_text() for page in pages}
    lengths = {page: [len(found) for _, found in measure(text)] for page, text in texts.items()}
    errors = [error for page, text in texts.items() for error in check(page, text)]
    if "--table" in sys.argv[1:]:
        for page, found in lengths.items():
            print(f"{page:26} {len(found):5} sentences, median {statistics.median(found or [0]):4}, worst "
                  f"{max(found or [0])}, over {WORDS_MAX}: {sum(n > WORDS_MAX for n in found)}")
    everything = [length for found in lengths.values() for length in found]
    print("\n".join(errors + [f"{len(pages)} pages, {len(everything)} sentences: median "
                              f"{statistics.median(everything):g}, worst {max(everything)} words"]))
    return 1 if errors or len(everything) < 50 * (len(sys.argv) == 1) else 0


if __name__ == "__main__":
    sys.exit(main())
