#!/usr/bin/python3
"""usage: manual.py TRUNNION SOURCE

Manual and completions say what the help says, and work where they are used: man renders every page without a warning,
and bash, zsh and fish complete commands, options, values and files.
"""
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PEOPLE = {"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "HOME": "/nonexistent", "TERM": "dumb"}


def trunnion(*words):
    return subprocess.run([BINARY, *words], capture_output=True, text=True, check=False, env=PEOPLE)


def commands():
    """Every command, also those of commands, as lists of words."""
    def listed(words):
        text = trunnion("help", *words).stdout.split("\nExit codes")[0]
        sections = re.split(r"^(?=\S.*:$)", text, flags=re.M)
        of_commands = [part for part in sections if not part.startswith(("Options", "Arguments", "[Option"))]
        return [words + [name] for part in of_commands for name in re.findall(r"^  ([a-z][\w-]*)(?:  |$)", part, re.M)]
    top = listed([])
    return top + [inner for words in top if re.search(r"^Usage: .* COMMAND$", trunnion("help", *words).stdout, re.M)
                  for inner in listed(words)]


class Help(unittest.TestCase):
    def test_every_command_has_a_help_that_fits(self):
        found = commands()
        self.assertGreater(len(found), 50)
        self.assertIn(["can", "sdo"], found)
        for words in found:
            done = trunnion("help", *words)
            self.assertEqual((done.returncode, done.stderr), (0, ""), words)
            self.assertIn(f"Usage: trunnion {' '.join(words)}", done.stdout)
            self.assertEqual(done.stdout, trunnion(*words, "--help").stdout, words)
            for line in done.stdout.splitlines():
                self.assertLessEqual(len(line), 125, (words, line))
                self.assertNotRegex(line, r"^  -\S.*?  +(?!(mm|deg|rad|um|ms) )[a-z]{2,} \S", words)
                if line.lstrip().startswith("--machine"):
                    self.fail(f"{words}: -m is a machine of other commands: {line}")

    def test_no_command_teaches(self):
        done = trunnion()
        self.assertEqual(done.returncode, 5)
        self.assertIn("trunnion run impeller", done.stdout)
        self.assertIn("trunnion help", done.stdout)

    def test_unknown_words_suggest(self):
        for words, said in ((["rnu"], "did you mean 'run'?"), (["can", "scna"], "did you mean 'scan'?"),
                            (["run", "x.ngc", "--machin", "y"], "did you mean '--machine'?"),
                            (["run", "--tols=3"], "did you mean '--tools'?"), (["help", "gatway"], "'gateway'"),
                            (["help", "G188"], "'trunnion mdi \"G188\"' runs"),
                            (["following_error"], "help following_error"),
                            (["jerk_mm_s3"], "help jerk_mm_s3"),
                            (["override", "50", "--off", "feed"], "'--of'")):
            done = trunnion(*words)
            self.assertEqual((done.returncode, done.stdout), (5, ""), words)
            self.assertIn(said, done.stderr, words)

    def test_one_word_too_many_is_named(self):
        for words, said in ((["daemon", "mill"], "'trunnion daemon' takes no 'mill'; did you mean '--machine mill'?"),
                            (["status", "--timeout", "3", "my.toml"], "did you mean '--machine my.toml'?"),
                            (["workspace", "hexapod"], "did you mean '--machine hexapod'?"),
                            (["status", "--machine", "x", "mill"], "'trunnion status' takes no 'mill'\n"),
                            (["hold", "now"], "'trunnion hold' takes no 'now'\n"),
                            (["config", "mill"], "'trunnion config' takes no 'mill'; did you mean '--check mill'?"),
                            (["run", "a.ngc", "b.ngc"], "'trunnion run' takes no 'b.ngc'\n"),
                            (["start", "impeller"], "'trunnion load impeller' gives the daemon this program"),
                            (["daemon"], "--machine is required"), (["load"], "program is required")):
            done = trunnion(*words)
            self.assertEqual((done.returncode, done.stdout), (5, ""), words)
            self.assertIn(said, done.stderr, words)

    def test_command_lines_are_read_as_people_write_them(self):
        asks = "the line was read, and no daemon has this name"

        def said(*words):
            text = trunnion(*words, "--machine", "nobody_here").stderr
            # Which of the two is said depends on the daemons that other tests run at this moment.
            return asks if re.search("no daemon runs here|'nobody_here' is neither a file nor a", text) else text

        self.assertEqual(said("jog", "X", "1"), asks)
        for words in (["X+"], ["+X"], ["x-"], ["Y-5"], ["Z-.5"], ["Z+0.25"], ["X", "-.5"], ["Joint0+"]):
            self.assertEqual(said("jog", *words), asks, words)
        for words in (["X10"], ["X2"], ["X"], ["X+fast"], ["X+1.2.3"], ["X+1-2"]):
            self.assertIn("distance is required", said("jog", *words), words)
        self.assertIn("has no option '-X'", said("jog", "-X", "5"))
        self.assertIn("Usage: trunnion jog", trunnion("jog", "-h").stdout)
        for words in (["80"], ["80%"], ["feed", "80"], ["rapid", "50%"], ["50", "Rapid"], ["50%", "--of", "rapid"],
                      ["--of", "rapid", "50"]):
            self.assertEqual(said("override", *words), asks, words)
        self.assertIn("'x%' is no number", said("override", "x%"))
        self.assertIn("percent: 201 is out of range", said("override", "feed", "201%"))
        self.assertEqual(trunnion("help", "run", "part.ngc").stdout, trunnion("help", "run").stdout)

    def test_a_word_that_begins_a_command_or_is_near_to_one_is_that_command(self):
        for word, near in (("stat", "status"), ("acknow", "acknowledge"), ("e-stop", "estop"), ("jogg", "jog"),
                           ("strat", "start"), ("hoem", "home"), ("comission", "commission")):
            self.assertIn(f"did you mean '{near}'?", trunnion(word).stderr, word)
        for word in ("st", "lamp", "mave", "hype", "moor"):  # two commands begin so; two slips in four letters
            self.assertIn(f"'{word}' is no command; 'trunnion help' lists them all", trunnion(word).stderr, word)

    def test_other_words_are_led_to_the_command_that_does_it(self):
        for words, meant in ((["check", "part.ngc"], "trunnion interpret"), (["simulate"], "trunnion run"),
                             (["pause"], "trunnion hold"), (["Cancel"], "trunnion stop"), (["move"], "trunnion jog"),
                             (["help", "rate"], "trunnion override 80"), (["shutdown"], "systemctl stop"),
                             (["G0", "X10", "Y-2"], "'trunnion mdi \"G0 X10 Y-2\"'"), (["m3"], "'trunnion mdi"),
                             (["impeller"], "'trunnion run impeller'"), (["mill.toml"], "--machine mill.toml"),
                             (["no_such.NC"], "there is no file of this name"),
                             ([f"{SOURCE}/examples/probe.ngc"], f"'trunnion run {SOURCE}/examples/probe.ngc'")):
            done = trunnion(*words)
            self.assertEqual((done.returncode, done.stdout), (5, ""), words)
            self.assertIn(meant, done.stderr, words)
        # Every command line that is proposed there is one that exists.
        text = pathlib.Path(SOURCE, "app/cli/meant_command.cc").read_text(encoding="utf-8")
        proposed = set(re.findall(r"'trunnion ([a-z][a-z-]*)", text))
        self.assertGreater(len(proposed), 20)
        for name in proposed:
            self.assertEqual(trunnion("help", name).returncode, 0, name)
        words = [word for row in re.findall(r'\{"([^"]+)",', text) for word in row.split()]
        self.assertEqual(len(words), len(set(words)), "a word has one meaning")
        for word in words:
            self.assertNotIn(f"Usage: trunnion {word}", trunnion("help", word).stdout, f"{word} is a command")

    def test_what_is_wrong_is_said_in_plain_words(self):
        for words, said in ((["override", "abc"], "percent: 'abc' is no number; 0 to 200 is legal\n"
                             "'trunnion override --help' explains this command\n"),
                            (["override", "500"], "percent: 500 is out of range; 0 to 200 is legal\n"
                             "'trunnion override --help' explains this command\n"),
                            (["completions", "tcsh"], "shell: tcsh is not legal; what is: bash, zsh, fish\n"
                             "'trunnion completions --help' explains this command\n"),
                            (["run", "--report"], "--report needs a value\n"
                             "'trunnion run --help' explains this command\n"),
                            (["parts", "1.5"], "count: '1.5' is no whole number; a whole number from 0 to 1000000000 "
                             "is legal\n'trunnion parts --help' explains this command\n"),
                            (["acknowledge", "0"], "number: '0' is out of range; a whole number from 1 to 1000000000 "
                             "is legal\n'trunnion acknowledge --help' explains this command\n"),
                            (["jog", "Y"], "distance is required\n'trunnion jog --help' explains this command\n")):
            done = trunnion(*words)
            self.assertEqual((done.returncode, done.stderr), (5, said), words)
        done = trunnion("can")
        self.assertEqual(done.returncode, 5)
        self.assertIn("'trunnion can' needs a command\n", done.stderr)
        self.assertIn("\nUsage: trunnion can [options] COMMAND\n", done.stderr)

    def test_a_word_of_a_table_is_named(self):
        for words, said in ((["X", "abc"], "'abc' behind X is no number"), (["X", "1", "Qz"], "'Qz' is not understood"),
                            (["Y", "X", "3"], "'X' behind Y is no number"), (["X"], "no number follows X")):
            done = trunnion("offset", "G55", *words)
            self.assertEqual(done.returncode, 5, words)
            self.assertIn(said, done.stderr)

    def test_help_is_as_wide_as_it_is_asked_to_be(self):
        for columns, widest in (("40", 40), ("70", 70), ("300", 100), ("wide", 100)):
            done = subprocess.run([BINARY, "help", "jog"], capture_output=True, text=True, check=True,
                                  env=dict(PEOPLE, COLUMNS=columns))
            texts = [line for line in done.stdout.splitlines() if line.startswith("     ")]
            self.assertGreater(len(texts), 3)
            self.assertLessEqual(max(len(line) for line in texts), widest, done.stdout)

    def test_a_negative_number_is_no_option(self):
        self.assertNotIn("option", trunnion("offset", "G54", "X", "-5", "--machine", "nothing").stderr)


def without_marks(markdown):
    return re.sub(r"`|\[|\]\([^)]*\)", "", markdown)


class Topics(unittest.TestCase):
    """What `trunnion help NAME` says of names that are no commands is what the reference pages say."""

    def told(self, *name):
        done = trunnion("help", *name)
        self.assertEqual((done.returncode, done.stderr), (0, ""), name)
        for line in done.stdout.splitlines():
            if not line.startswith("    "):  # an example, as it stands in the page
                self.assertLessEqual(len(line), 100, name)
                self.assertNotRegex(line, r"\*\*|`|\]\(|<br>|<!--|^\|", name)
        return done.stdout

    def known_codes(self):
        """Every code that the interpreter has, by its own answers to all there could be."""
        ends = ["M2", "M30", "M99"]
        codes = [f"G{i // 10}" + (f".{i % 10}" if i % 10 else "") for i in range(9999)]
        codes += [f"M{i}" for i in range(999) if f"M{i}" not in ends]
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder, "all.ngc")
            program.write_text("".join(f"{code}\n" for code in codes) + "M2\n")
            said = trunnion("interpret", str(program), "--machine", f"{SOURCE}/configs/cradle.toml", "--max-errors",
                            str(len(codes))).stderr
        unknown = re.findall(r"unknown [GM] code (\S+?):|: (\S+) is a code of other controls", said)
        self.assertGreater(len(unknown), 9000)
        return ends + [code for code in codes if code not in {word for pair in unknown for word in pair}]

    def test_every_code_is_explained(self):
        known = self.known_codes()
        self.assertTrue({"G0", "G33.1", "G59.3", "G68.2", "G183", "M62", "M428"} <= set(known), known)
        self.assertLess(len(known), 200)
        for code in known:
            self.assertRegex(self.told(code), rf"(?<![A-Z]){re.escape(code)}(?![.\d])", code)
        self.assertEqual(self.told("g01"), self.told("G1"))
        self.assertNotIn("M64", self.told("M66").split("Q0            (now)")[1])  # of a table its own row
        self.assertIn("G10 L2 R turns a system", self.told("G68"))
        for word in "FST":
            self.assertRegex(self.told(word), rf"(?m)^{word} ")

    def test_every_fault_and_word_is_explained(self):
        for page in ("faults", "glossary"):
            text = pathlib.Path(SOURCE, f"docs/{page}.md").read_text(encoding="utf-8")
            rows = re.findall(r"(?m)^\| `?([^|`]+)`? \| (.*) \|$", text)[1:]
            self.assertGreater(len(rows), 30)
            all_commands = {words[0] for words in commands()}
            for name, cells in rows:
                if name in all_commands:  # its help comes first
                    continue
                shown = " ".join(self.told(name.split(", ")[0]).split())
                for cell in cells.split(" | "):
                    self.assertIn(" ".join(without_marks(cell).split()), shown, name)
        self.assertEqual(self.told("Feed", "HOLD"), self.told("feed hold"))
        self.assertIn("trunnion override 80", self.told("feed"))

    def test_keys_are_explained(self):
        tables = json.loads(trunnion("config", "--keys", "--json").stdout)["tables"]
        for table in random.Random(7).sample(tables, 25):
            key = table["keys"][-1]
            shown = self.told(f"{table['table']}.{key['key']}")
            self.assertIn(f"[{table['table']}]", shown)
            self.assertIn(key["key"], shown)
            self.assertIn(" ".join(without_marks(key["meaning"]).split()[:5]), " ".join(shown.split()))
        self.assertGreater(self.told("type").count("type, a key of ["), 2)


class Manual(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.pages = pathlib.Path(cls.folder.name, "man1")
        assert trunnion("man", "--all", str(cls.pages)).returncode == 0
        (cls.pages / "trunnion-drives.1").write_text(subprocess.run(
            [BINARY + "-drives", "--man"], check=True, capture_output=True, text=True).stdout)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @staticmethod
    def rendered(page):
        """The page as people read it."""
        done = subprocess.run(["man", "--warnings", "-l", page], capture_output=True, text=True, check=True,
                              env={**PEOPLE, "MANWIDTH": "90", "MANPAGER": "cat"})
        assert done.stderr == "", (page, done.stderr)
        return re.sub(r".\x08", "", done.stdout)

    @unittest.skipUnless(shutil.which("man"), "man is not here")
    def test_every_command_has_a_page_without_a_warning(self):
        for words in commands():
            text = self.rendered(self.pages / f"trunnion-{words[0]}.1")
            self.assertIn(" ".join(["trunnion", *words]), text)
        for page in self.pages.iterdir():
            text = self.rendered(page)
            for part in ("NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXIT STATUS"):
                self.assertIn(f"\n{part}\n", text, page.name)

    @unittest.skipUnless(shutil.which("man"), "man is not here")
    def test_a_page_has_every_option_of_the_help(self):
        for words in commands():
            page = self.rendered(self.pages / f"trunnion-{words[0]}.1")
            for option in re.findall(r"(?<![\w-])--[a-z][\w-]*", trunnion("help", *words).stdout):
                self.assertIn(option, page, words)

    def test_backslashes_and_points_survive(self):
        run = (self.pages / "trunnion-run.1").read_text()
        self.assertNotRegex(run, re.compile(r"^'", re.M))
        self.assertIn(r"\-\-machine", run)


class Completion(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        for name in ("mill.toml", "part.ngc", "two words.ngc", "tools.tbl", "notes.txt"):
            pathlib.Path(cls.folder.name, name).touch()
        pathlib.Path(cls.folder.name, "parts").mkdir()
        cls.environment = {**PEOPLE, "PATH": f"{os.path.dirname(BINARY)}:/usr/bin:/bin", "HOME": cls.folder.name,
                           "XDG_CONFIG_HOME": cls.folder.name, "XDG_DATA_HOME": cls.folder.name}

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def shell(self, *command):
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=self.folder.name,
                              env=self.environment)
        self.assertEqual(done.stderr, "", command)
        return set(done.stdout.split("\n")) - {""}

    def bash(self, *words):
        """What bash offers for the last word."""
        quoted = " ".join(f"'{word}'" for word in ("trunnion", *words))
        return self.shell("bash", "--norc", "-c", f'eval "$(trunnion completions bash)"; COMP_WORDS=({quoted}); '
                          f'COMP_CWORD={len(words)}; _trunnion; printf "%s\\n" "${{COMPREPLY[@]}}"')

    def test_bash(self):
        self.assertLessEqual({"run", "daemon", "help", "touch-off"}, self.bash(""))
        self.assertEqual(self.bash("sta"), {"start", "status"})
        self.assertLessEqual({"scan", "sdo", "nmt"}, self.bash("can", ""))
        self.assertEqual(self.bash("run", "--trace-"), {"--trace-density", "--trace-corrections"})
        for given in ([], ["="]):  # files, and machines by their names
            offered = self.bash("run", "--machine", *given, "")
            self.assertLessEqual({"mill.toml", "parts", "hexapod", "rail_mill"}, offered)
            self.assertFalse({"part.ngc", "notes.txt"} & offered)
        self.assertEqual(self.bash("tune", "X", "--machine", "hex"), {"hexapod", "hexapod_can"})
        self.assertEqual(self.bash("run", "--machine", "mill.toml", "p"), {"part.ngc", "parts"})
        self.assertEqual(self.bash("run", "two"), {"two words.ngc"})
        self.assertEqual(self.bash("override", "50", "--of", ""), {"feed", "rapid", "spindle", "adaptive"})
        self.assertEqual(self.bash("step", "o"), {"on", "off"})
        self.assertEqual(self.bash("help", "gate"), {"gateway"})
        self.assertEqual(self.bash("help", "can", "sd"), {"sdo"})
        self.assertEqual(self.bash("run", "--from", ""), set())
        self.assertEqual(self.bash("run", "notes"), {"notes.txt"})

    def test_every_option_is_offered(self):
        for words in commands():
            for option in re.findall(r"^  (?:-\w,)?(--[a-z][\w-]*)", trunnion("help", *words).stdout, re.M):
                self.assertIn(option, self.bash(*words, option), words)

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not here")
    def test_zsh(self):
        # What reaches _describe and _files, which need a line editor to go on.
        script = ("autoload -Uz compinit; compinit -u -d $HOME/dump; eval \"$(trunnion completions zsh)\"; "
                  "_describe() { print -l -- \"${(@P)3}\"; }; _files() { print -l -- files \"$@\"; }; "
                  "words=(trunnion \"$@\"); CURRENT=$#words; _trunnion")
        zsh = lambda *words: self.shell("zsh", "-f", "-c", script, "zsh", *words)
        self.assertIn("status:Show the state of machine and daemon, once", zsh("sta"))
        self.assertTrue(any(line.startswith("start:Start the loaded program") for line in zsh("sta")))
        offered = zsh("run", "--machine", "")
        self.assertLessEqual({"files", "-g", "*.toml(-.)", "hexapod:a machine by its name"}, offered)
        self.assertEqual({line.split(":")[0] for line in zsh("step", "o")}, {"on", "off"})

    @unittest.skipUnless(shutil.which("fish"), "fish is not here")
    def test_fish(self):
        fish = lambda line: {word.split("\t")[0] for word in self.shell(
            "fish", "--no-config", "-c", f"trunnion completions fish | source; complete -C '{line}'")}
        self.assertEqual(fish("trunnion sta"), {"start", "status"})
        self.assertEqual(fish("trunnion run --trace-"), {"--trace-density", "--trace-corrections"})
        self.assertEqual(fish("trunnion override 50 --of "), {"feed", "rapid", "spindle", "adaptive"})
        self.assertLessEqual({"mill.toml", "hexapod"}, fish("trunnion run --machine "))


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
