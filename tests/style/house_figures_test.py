#!/usr/bin/python3
"""scripts/house_figures.py counts a small tree as one counts it by hand, and this tree without a contradiction."""
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts/house_figures.py"
sys.path.insert(0, str(SCRIPT.parent))
import house_figures  # noqa: E402

TREE = {
    "core/ring.h": "/// Of two.\nstruct Ring {\n  int top() const { return a; }\n"
                   "  int a = 0;  // no comment line\n};\n",
    "kernel/cycle.h": '#include "core/ring.h"\n',
    "kernel/cycle.cc": '#include "kernel/cycle.h"\n/* one\n   two */\nint f(int a) {\n  TRN_CHECK(a > 0);\n'
                       '  // TRN_CHECK(a > 1);\n  return a;\n}\n',
    "kernel/rate/plan.cc": '#include "kernel/cycle.h"\n#include "core/ring.h"\n#include <vector>\nvoid g() {}\n',
    "tests/core/ring_test.cc": '#include "core/ring.h"\nTEST(Ring, IsOne) {}\n',
    "main.cc": "int main() {}\n",
}


class SmallTree(unittest.TestCase):
    def setUp(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in TREE.items():
                path = Path(folder) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            self.rows = house_figures.table(Path(folder))

    def test_every_room_has_a_row(self):
        self.assertEqual(list(self.rows), ["core", "kernel", "kernel/rate", "product", "tests"])

    def test_sizes(self):
        kernel = self.rows["kernel"]
        self.assertEqual([kernel[c] for c in ("files", "lines", "functions", "median", "p95", "longest")],
                         [2, 9, 1, 5, 5, 5])
        self.assertEqual(kernel["comment"], 33.3)  # three of nine
        self.assertEqual(self.rows["core"]["comment"], 20)

    def test_checks_in_comments_are_none(self):
        self.assertEqual(self.rows["kernel"]["checks"], 1)

    def test_a_header_and_its_source_are_one_unit(self):
        self.assertEqual([(self.rows[f]["units"], self.rows[f]["tested"]) for f in ("core", "kernel", "product")],
                         [(1, 1), (1, 0), (3, 1)])

    def test_edges_cross_a_border(self):
        folders = ("core", "kernel", "kernel/rate", "product")
        self.assertEqual([(self.rows[f]["out"], self.rows[f]["in"]) for f in folders], [(0, 2), (1, 1), (2, 0), (3, 3)])

    def test_shares_of_lengths(self):
        self.assertEqual([house_figures.share(range(1, 101), part) for part in (0.5, 0.95, 1)], [50, 95, 100])


class ThisTree(unittest.TestCase):
    def test_sums_and_limits(self):
        text = subprocess.run([SCRIPT, "--json"], capture_output=True, text=True, check=True).stdout
        rows = json.loads(text)
        folders = [row for name, row in rows.items() if name not in ("product", *house_figures.BESIDE)]
        for column in ("files", "lines", "functions", "checks", "units", "out", "in"):
            self.assertEqual(rows["product"][column], sum(row[column] for row in folders), column)
        self.assertGreater(rows["product"]["functions"], 5000)
        self.assertLessEqual(rows["product"]["longest"], 70)  # as check_form.py says of every function

    def test_unknown_commit(self):
        run = subprocess.run([SCRIPT, "--commit", "no-such-commit"], capture_output=True, text=True)
        self.assertEqual((run.returncode, run.stdout), (1, ""))
        self.assertIn("no such commit", run.stderr)


if __name__ == "__main__":
    unittest.main()
