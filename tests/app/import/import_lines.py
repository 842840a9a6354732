#!/usr/bin/python3
"""usage: import_lines.py TRUNNION SOURCE_DIR

`trunnion import linuxcnc` loses no line in silence: lines of machines are changed, drawn with a seed.
"""
import random
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

BINARY, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
MACHINES = SOURCE / "tests/app/import/machines"


class NothingIsLost(unittest.TestCase):
    maxDiff = None
    """A line that says something else makes another machine, another note or an error: it has been read."""
    # What LinuxCNC and its screens do among themselves; a code of one's own belongs to no modal group here.
    SAME = re.compile(r"JOINTS|KINEMATICS|loadrt (trivkins|\[KINS\]KINEMATICS)|HALUI|VERSION|MACHINE|DEBUG|"
                      r"REMAP = .*modalgroup")

    @staticmethod
    def otherwise(line):
        """The line with its last number 0.73 times as great, or its last word another one."""
        found = list(re.finditer(r"(?<![\w.])-?\d+\.?\d*(?![\w.])", line))
        if found and float(found[-1][0]) != 0:
            return f"{line[:found[-1].start()]}{0.73 * float(found[-1][0]):.6g}{line[found[-1].end():]}"
        return f"{line.rstrip()}x\n"

    def heard(self, folder, ini):
        made = folder / "made"
        shutil.rmtree(made, ignore_errors=True)
        done = subprocess.run([BINARY, "import", "linuxcnc", ini, "--to", "made"], cwd=folder, capture_output=True,
                              text=True, timeout=120, check=False)
        files = {f.name: f.read_text() for f in made.glob("*")} if made.exists() else {}
        return done.returncode, done.stdout, done.stderr, files

    def test_every_line_matters(self):
        randomly, tried, lost = random.Random(26), 0, []
        for ini, files in (("router.ini", ["router.ini", "router.hal", "router.tbl"]), ("gantry.ini", ["gantry.ini"]),
                           ("mill_inch.ini", ["mill_inch.ini", "mill_inch.hal", "mill_axes.inc", "mill_inch.tbl"])):
            folder = Path(self.enterContext(tempfile.TemporaryDirectory()), "machines")
            shutil.copytree(MACHINES, folder)
            before = self.heard(folder, ini)
            self.assertEqual(before[0], 0, before[2])
            lines = [(name, i) for name in files
                     for i, line in enumerate((MACHINES / name).read_text().splitlines())
                     if line.strip() and line.strip()[0] not in "#;[" and not self.SAME.match(line)]
            for name, i in randomly.sample(lines, min(len(lines), 40)):
                text = (MACHINES / name).read_text().splitlines(keepends=True)
                # Notes of HAL say which signals and modules there are, and not every pin of theirs.
                other = "\n" if name.endswith(".hal") else self.otherwise(text[i])
                (folder / name).write_text("".join([*text[:i], other, *text[i + 1:]]))
                if self.heard(folder, ini) == before:
                    lost.append(f"{name}:{i + 1}: '{text[i].strip()}' -> '{other.strip()}'")
                (folder / name).write_text("".join(text))
                tried += 1
        self.assertEqual(lost, [], "are not read")
        self.assertGreater(tried, 80)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
