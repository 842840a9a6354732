#!/usr/bin/python3
"""usage: version.py TRUNNION SOURCE

--version tells version and commit: of the repository, of an archive that git made, and of a source with neither.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest


def output(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options).stdout


class VersionTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.source = self.folder / "source"
        (self.source / "cmake").mkdir(parents=True)
        for name in (".gitattributes", "cmake/archive_commit", "cmake/commit.cmake"):
            shutil.copy(SOURCE / name, self.source / name)

    def git(self, *words):
        return output("git", "-c", "user.name=x", "-c", "user.email=x@x", "-C", self.source, *words).strip()

    def commit_of(self, source):
        out = self.folder / "commit.h"
        output("cmake", "-D", f"SOURCE={source}", "-D", f"OUT={out}", "-P", source / "cmake/commit.cmake")
        return re.fullmatch(r'#define TRN_COMMIT "(.*)"\n', out.read_text()).group(1)

    def make_repository(self):
        self.git("init", "-q")
        self.git("add", ".")
        self.git("commit", "-q", "-m", "all")
        return self.git("rev-parse", "--short=10", "HEAD")

    def test_a_repository(self):
        head = self.make_repository()
        self.assertEqual(self.commit_of(self.source), f"commit {head}")
        with open(self.source / "cmake/commit.cmake", "a", encoding="ascii") as file:
            file.write("# mine\n")
        self.assertEqual(self.commit_of(self.source), f"commit {head}, with local changes")

    def test_an_archive_that_git_made(self):
        self.make_repository()
        archive = self.folder / "archive.tar"
        self.git("archive", "-o", archive, "HEAD")
        unpacked = self.source / "unpacked"  # inside a repository, which is not its own
        unpacked.mkdir()
        output("tar", "-xf", archive, "-C", unpacked)
        head = self.git("rev-parse", "--short", "HEAD")
        self.assertEqual(self.commit_of(unpacked), f"packaged source of commit {head}")

    def test_a_source_without_git(self):
        self.assertEqual(self.commit_of(self.source), "packaged source, commit not known")

    def test_the_programs_say_the_version_of_the_changelog(self):
        changes = (SOURCE / "CHANGELOG.md").read_text()
        dated = re.search(r"^## \[(\d+\.\d+\.\d+)\] - \d{4}-\d\d-\d\d$", changes, re.M)
        self.assertIsNotNone(dated, "no dated section")
        for program in ("trunnion", "trunnion-drives"):
            said = output(BINARY.parent / program, "--version")
            source = r"\((commit [0-9a-f]{10}|packaged source).*\)"
            self.assertRegex(said, rf"^{program} {re.escape(dated.group(1))} {source}\n$")


if __name__ == "__main__":
    BINARY, SOURCE = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    unittest.main(argv=[sys.argv[0], "-v"])
