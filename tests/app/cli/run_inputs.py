#!/usr/bin/python3
"""usage: run_inputs.py TRUNNION SOURCE

What `trunnion run` is given: a program that is not there, the comment that names machine and tools in any of the forms
in which people write it, a machine by its name, and files that cannot be written.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = "G21 G90\nG0 X1\nG1 X3 F600\nM2\n"


class RunInputs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for name in ("x.toml", "my mill.toml"):
            shutil.copy(f"{SOURCE}/configs/mill.toml", self.folder / name)
        for name in ("t.tbl", "my tools.tbl"):
            (self.folder / name).write_text("T1 P1 Z50 D6\n", encoding="ascii")

    def run_program(self, text, *options):
        (self.folder / "part.ngc").write_text(text, encoding="ascii")
        return self.trunnion("run", "part.ngc", *options)

    def trunnion(self, *words, **environment):
        return subprocess.run([BINARY, *words], capture_output=True, text=True, check=False, cwd=self.folder,
                              timeout=120, env={**os.environ, **environment})

    def test_the_comment_in_its_forms(self):
        for head, machine, tools in (("(machine: x.toml)", "x.toml", ""), ("(MACHINE: x.toml)", "x.toml", ""),
                                     ("( machine : x.toml )", "x.toml", ""), ("; machine: x.toml", "x.toml", ""),
                                     ("(machine: my mill.toml; tools: my tools.tbl)", "my mill.toml", "my tools.tbl"),
                                     ('(machine: "my mill.toml", mine)', "my mill.toml", ""),
                                     ("(machine: x.toml, a mill; Tools: t.tbl)", "x.toml", "t.tbl"),
                                     ("; Machine:x.toml; tools : 't.tbl'", "x.toml", "t.tbl"),
                                     ("G21 (face) (machine: x.toml)", "x.toml", "")):
            done = self.run_program(head + "\n" + PROGRAM, "--files")
            self.assertEqual((done.returncode, done.stderr), (0, ""), head)
            self.assertEqual(done.stdout.splitlines(), ["part.ngc", machine, tools], head)

    def test_what_the_comment_names_in_vain_is_told(self):
        done = self.run_program("G21\n(machine: Haas VF2; tools: 5)\n" + PROGRAM)
        self.assertEqual(done.returncode, 5)
        self.assertEqual(done.stderr.splitlines()[:2],
                         ["part.ngc:2:2: warning: 'machine:' names no .toml file: 'Haas VF2'",
                          "part.ngc:2:21: warning: 'tools:' names no .tbl file: '5'"])
        self.assertIn("--machine", done.stderr)
        # Whoever has said it otherwise, or speaks of machines, is not bothered.
        for text, options in (("(machine: Haas VF2)\n", ["--machine", "x.toml"]),
                              ("(zero of the machine: corner)\n(machine: x.toml)\n", [])):
            self.assertNotIn("names no", self.run_program(text + PROGRAM, *options).stderr)

    def named(self, name, *options):
        """The config that `--machine NAME` is, with the folder's own in front of those that come with Trunnion."""
        done = self.run_program("G21\n" + PROGRAM, "--files", "--machine", name, *options)
        self.assertEqual((done.returncode, done.stderr), (0, ""), name)
        return done.stdout.splitlines()[1]

    def test_a_machine_by_its_name(self):
        shipped = pathlib.Path(self.named("hexapod"))
        self.assertTrue(shipped.is_absolute() and shipped.is_file(), shipped)
        self.assertEqual(shipped.name, "hexapod.toml")
        (self.folder / "configs").mkdir()
        (self.folder / "configs/hexapod.toml").write_text("# my own", encoding="ascii")
        self.assertEqual(self.named("hexapod"), "configs/hexapod.toml")
        self.assertEqual(self.named("x"), "x.toml")
        (self.folder / "lathe").mkdir()  # as `import` leaves it
        (self.folder / "lathe/lathe.toml").write_text("# imported", encoding="ascii")
        self.assertEqual(self.named("lathe"), "lathe/lathe.toml")
        (self.folder / "lathe.toml").mkdir()  # no file
        self.assertEqual(self.named("lathe"), "lathe/lathe.toml")
        (self.folder / "bare").write_text("# a config without an ending", encoding="ascii")
        self.assertEqual(self.named("bare"), "bare")
        for path in ("./hexapod", "hexapod.tom", "configs/hexapod"):  # no names
            self.assertEqual(self.named(path), path)

    def test_a_machine_by_its_name_in_the_comment(self):
        for head in ("(machine: x)", "(MACHINE: X)", "(machine: x, mine)", "; machine: x; tools: t.tbl"):
            done = self.run_program(head + "\n" + PROGRAM, "--files")
            self.assertEqual((done.returncode, done.stderr), (0, ""), head)
            self.assertEqual(done.stdout.splitlines()[1], "x.toml", head)
        (self.folder / "jobs").mkdir()  # relative to the program
        shutil.copy(self.folder / "x.toml", self.folder / "jobs/y.toml")
        (self.folder / "jobs/y.ngc").write_text("(machine: y)\n" + PROGRAM, encoding="ascii")
        self.assertEqual(self.trunnion("run", "jobs/y.ngc", "--files").stdout.splitlines()[1], "jobs/y.toml")

    def test_a_name_that_no_machine_has(self):
        for command in (["run", "part.ngc"], ["daemon"], ["workspace"], ["kin", "words"], ["panel"], ["io"]):
            done = self.trunnion(*command, "--machine", "hexapot")
            self.assertEqual((done.returncode, done.stdout), (5, ""), command)
            self.assertIn("--machine: no machine has the name 'hexapot'; did you mean 'hexapod'? Known: ", done.stderr)
            self.assertIn(", hexapod, ", done.stderr)
        # The page needs a config, also where the environment names the machine for all commands.
        done = self.trunnion("panel", TRUNNION_MACHINE="hexapot")
        self.assertEqual(done.returncode, 5)
        self.assertIn("no machine has the name 'hexapot'", done.stderr)
        # A client asks for a daemon of that name, and what writes a config wants to be told the file.
        self.assertNotIn("did you mean", self.trunnion("status", "--machine", "hexapot").stderr)
        self.assertEqual(self.trunnion("commission", "--machine", "hexapod").returncode, 5)

    def test_a_variable_is_only_for_the_commands_that_take_it(self):
        """The name of a machine whose daemon runs is no name of a config, and what nobody asks for harms nobody."""
        (self.folder / "part.ngc").write_text(PROGRAM, encoding="ascii")
        for variables in ({"TRUNNION_MACHINE": "mine"}, {"TRUNNION_TIMEOUT": "soon"}):
            for command in (["kin", "words", "--machine", "x"], ["run", "part.ngc", "--files", "--machine", "x"],
                            ["config", "--check", "x.toml"], ["--version"]):
                done = self.trunnion(*command, **variables)
                self.assertEqual((done.returncode, done.stderr), (0, ""), (command, variables))
        done = self.trunnion("status", TRUNNION_MACHINE="mine")
        self.assertEqual(done.returncode, 4)
        self.assertRegex(done.stderr, "'mine' is neither a file nor a machine|no daemon runs here")
        for command in (["status"], ["jog", "X", "1"], ["scope", "X.setpoint"]):
            done = self.trunnion(*command, TRUNNION_TIMEOUT="soon")
            self.assertEqual(done.returncode, 5)
            self.assertIn("TRUNNION_TIMEOUT gives this value", done.stderr)
            done = self.trunnion(*command, "--help", TRUNNION_TIMEOUT="soon")
            self.assertEqual((done.returncode, done.stderr), (0, ""), command)
            self.assertIn("environment variable TRUNNION_TIMEOUT", done.stdout.replace("\n", " ").replace("  ", ""))
        done = self.trunnion("status", "--machine", "x.toml", "--timeout", "0.2", TRUNNION_TIMEOUT="soon")
        self.assertEqual(done.returncode, 4)
        self.assertIn("within 0.2 s", done.stderr)

    def test_a_program_that_is_none(self):
        for program, why in (("nothing.ngc", "No such file or directory"), (".", "it is a folder")):
            done = self.trunnion("run", program)
            self.assertEqual((done.returncode, done.stderr),
                             (2, f"cannot read '{program}': {why}; legal: a readable file\n"))
            self.assertEqual(self.trunnion("interpret", program).stderr, done.stderr)

    def test_files_that_cannot_be_written(self):
        (self.folder / "file").write_text("", encoding="ascii")
        for option in ("--trace", "--path", "--stretches", "--report", "--preview", "--log", "--logs"):
            done = self.run_program(PROGRAM, "-m", "x.toml", option, "file/out")
            self.assertEqual((done.returncode, done.stdout), (5, ""), (option, done.stderr))
            self.assertRegex(done.stderr, "^file/out: cannot (write|make) .*Not a directory\n$", option)

    def test_a_machine_that_comes_with_trunnion_is_copied_before_it_is_written(self):
        done = self.trunnion("commission", "-m", "cradle_can")
        self.assertEqual((done.returncode, done.stdout), (5, ""))
        copy = re.search("give the copy: (cp .*cradle_can.toml cradle_can.toml)$", done.stderr, re.M)
        self.assertTrue(copy, done.stderr)
        subprocess.run(copy[1], shell=True, check=True, cwd=self.folder)
        self.assertTrue((self.folder / "cradle_can.toml").exists())
        self.assertIn("does not exist", self.trunnion("commission", "-m", "no_such").stderr)

    def test_what_takes_long_is_not_done_for_nothing(self):
        """An hour of `latency`, or a commissioning, whose result cannot be written."""
        (self.folder / "file").write_text("old", encoding="ascii")
        for words in (("latency", "--seconds", "600", "--svg"), ("workspace", "-m", "mill", "--csv"),
                      ("workspace", "-m", "mill", "--svg"), ("commission", "-m", "x.toml", "--protocol"),
                      ("commission", "-m", "x.toml", "--record"),
                      ("tune", "X", "-m", "cradle_can", "--emulated", "--write"),
                      ("tune", "X", "-m", "cradle_can", "--emulated", "--svg"),
                      ("micromill", "train", "-m", "micro_stage", "--out"),
                      ("micromill", "experiment", "-m", "micro_stage", "--pictures"),
                      ("ballbar", "run", "-m", "cradle", "--out"), ("ballbar", "patterns", "-m", "cradle", "--out")):
            done = self.trunnion(*words, "file/out")
            self.assertEqual((done.returncode, done.stdout), (5, ""), (words, done.stderr))
            self.assertRegex(done.stderr, "^file/out: cannot (write|make) .*Not a directory\n$", words)
        done = self.trunnion("latency", "--seconds", "0.1", "--svg", "file")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("</svg>", (self.folder / "file").read_text(encoding="utf-8"))

    def test_a_folder_where_a_file_is_meant(self):
        """Read as a file it is empty: a script of the operator would be one that does nothing."""
        (self.folder / "traces").mkdir()
        (self.folder / "part.ngc").write_text(PROGRAM, encoding="ascii")
        machine = ("--machine", "cradle")
        for words in (("run", "part.ngc", "--machine", "x.toml", "--operator"), ("replay", "--trace", "t.csv"),
                      ("scope", "--read"), ("ballbar", "identify", *machine), ("ball", "fit", *machine),
                      ("joint-table", "fit", *machine)):
            for name, why in (("traces", "this is a folder; name a file in it"),
                              ("none", "cannot read this file: No such file or directory")):
                done = self.trunnion(*words, name)
                self.assertEqual((done.returncode, done.stdout), (2, ""), (words, done.stderr))
                self.assertIn(f"{name}: {why}\n", done.stderr, words)

    def test_a_script_from_a_pipe(self):
        (self.folder / "part.ngc").write_text(PROGRAM, encoding="ascii")
        command = f"'{BINARY}' run part.ngc --machine x.toml --operator <(echo 0.01 hold; echo 0.5 resume)"
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, cwd=self.folder,
                              timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        free = self.run_program(PROGRAM, "--machine", "x.toml")
        periods = [int(re.search(r"(\d+) periods", run.stdout)[1]) for run in (free, done)]
        self.assertGreater(periods[1], periods[0] + 300)

    def test_a_table_that_is_none(self):
        done = self.run_program(PROGRAM, "--machine", "x.toml", "--tools", "x.toml")
        self.assertEqual(done.returncode, 2)
        self.assertIn("this looks like no tool table; a tool is a line as 'T1 P1 Z50.5 D6 ;end mill'", done.stderr)

    def test_advice_has_a_feed_to_be_about(self):
        threads = "G21 G90 S600 M3\nG0 X0 Z0\nG33 Z-20 K1\nG0 X5\nG0 Z0\nM2\n"
        for text, advice in ((PROGRAM.replace("F600", "F60"), True), ("G21\nG4 P3\nM2\n", False), (threads, False)):
            done = self.run_program(text, "--machine", "x.toml")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual("A higher F" in done.stdout, advice, done.stdout)


if __name__ == "__main__":
    BINARY, SOURCE = sys.argv[1:3]
    BINARY = str(pathlib.Path(BINARY).absolute())
    SOURCE = str(pathlib.Path(SOURCE).absolute())
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
