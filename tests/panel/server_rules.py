#!/usr/bin/env python3
"""A real panel before a daemon that does what the test says: jogs that must move once and end with their page, programs
and files that a page may have.

usage: server_rules.py TRUNNION_BINARY SOURCE_DIR
"""
import json
import os
import re
import sys
import time
import unittest

from fake_daemon import FakeDaemon, command_t  # which finds tests/support
from instrumented import sanitized
from page_client import PATIENCE_S, Page, get
from panel_bench import PanelBench

BINARY, SOURCE = "", ""


class RulesTest(unittest.TestCase):
    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE, daemon=False)
        self.addCleanup(self.bench.close)
        self.daemon = FakeDaemon(self.bench)
        self.addCleanup(self.daemon.close)
        self.bench.start_panel()
        self.daemon.accept()
        self.holder = None
        self.page = self.operator()

    def looker(self):
        page = Page(self.bench)
        self.addCleanup(page.close)
        page.until(lambda m: m["type"] == "status")
        return page

    def operator(self):
        """A page that has the controls; who had them gives them."""
        page = self.looker()
        page.take_controls(giver=self.holder)
        self.holder = page
        return page

    def jog(self, press, number=1, **more):
        """Asks for a jog without waiting for the answer."""
        self.page.send({"type": "command", "id": number, "verb": "jog", "joint": 0, "value": 1, "speed": 1,
                        "press": press} | more)

    def answer(self, number=1):
        return self.page.until(lambda m: m["type"] == "answer" and m["id"] == number)

    def accepted_jog(self, press=1, **more):
        """A jog that goes on; returns how many there were."""
        times = self.daemon.verbs().count(command_t.JOG) + 1
        self.jog(press, **more)
        command = self.daemon.until(command_t.JOG, times)
        self.daemon.said("jogging")
        self.daemon.reply(command)
        self.assertEqual(self.answer()["outcome"], "accepted")
        self.page.state("jogging")
        return times

    def ended_jog(self, press=1):
        times = self.accepted_jog(press)
        self.daemon.said("idle")
        self.page.state("idle")
        return times


class Verbs(RulesTest):
    def test_every_verb_of_the_message_is_a_page_s(self):
        source = os.path.join(SOURCE, "hal/lcm/command_t.lcm")
        with open(source, encoding="utf-8") as file:
            names = set(re.findall(r"\b([A-Z_]+) = \d+", file.read())) - {"OWN", "MACHINE", "WORK", "TOOL", "PATH"}
        self.assertTrue(names >= {"LOAD", "JOG", "ACKNOWLEDGE", "MACHINE_LOCK"}, names)
        # A load wants a program of the folder; behind a jog that goes on others are refused.
        for number, name in enumerate([*sorted(names - {"LOAD", "JOG"}), "JOG"]):
            self.page.send({"type": "command", "id": number, "verb": name.lower(), "press": number + 1, "value": 1})
            self.assertEqual(self.daemon.until(getattr(command_t, name)).value, 1, name)


class Jogs(RulesTest):
    def refused(self, press):
        self.jog(press, number=9)
        answer = self.answer(9)
        self.assertEqual((answer["outcome"], answer["text"]), ("refused", "this press was obeyed before"))

    def test_a_press_moves_once(self):
        self.ended_jog(press=7)
        self.refused(7)
        self.assertEqual(self.ended_jog(press=8), 2)
        self.refused(7)
        self.assertEqual(self.daemon.verbs().count(command_t.JOG), 2)

    def test_a_jog_away_from_a_held_program_ends_with_its_page(self):
        self.daemon.said("holding")
        self.page.state("holding")
        self.jog(7)
        command = self.daemon.until(command_t.JOG)
        self.daemon.said("holding", detour="jogs")
        self.daemon.reply(command)
        self.assertEqual(self.answer()["outcome"], "accepted")
        self.page.until(lambda m: m["type"] == "status" and m["detour"] == "jogs")
        # The page says nothing more: that is seen half a second later.
        self.assertEqual(self.daemon.until(command_t.JOG, 2).value, 0)
        self.daemon.said("holding", detour="away")
        self.page.until(lambda m: m["type"] == "status" and m["detour"] == "away")
        self.page.send({"type": "command", "id": 3, "verb": "resume"})
        self.daemon.until(command_t.RESUME)

    def test_a_held_press_is_said_again_while_its_page_lives(self):
        self.accepted_jog(press=7, alive_ms=200)
        for times in (2, 3):
            self.page.send({"type": "alive"})
            again = self.daemon.until(command_t.JOG, times)
            self.assertEqual((again.joint, again.value, again.alive_ms), (0, 1, 200))
            self.daemon.reply(again)
        self.refused(7)

    def test_a_held_press_is_not_said_again_behind_its_end(self):
        self.accepted_jog(press=7, alive_ms=200)
        self.page.send({"type": "command", "id": 2, "verb": "jog", "joint": 0, "value": 0})
        self.page.send({"type": "alive"})
        self.page.send({"type": "command", "id": 3, "verb": "estop"})
        self.daemon.until(command_t.ESTOP)
        jogs = [(one.value, one.alive_ms) for one in self.daemon.heard if one.verb == command_t.JOG]
        self.assertEqual(jogs, [(1, 200), (0, 0)])

    def test_what_the_daemon_refuses_is_not_said_again(self):
        self.accepted_jog(press=7, alive_ms=200)
        self.page.send({"type": "alive"})
        self.daemon.reply(self.daemon.until(command_t.JOG, 2), outcome=3, message="X stands at its limit")
        self.page.until(lambda m: m["type"] == "message" and m["text"] == "X stands at its limit")
        self.page.send({"type": "alive"})
        self.page.send({"type": "command", "id": 3, "verb": "estop"})
        self.daemon.until(command_t.ESTOP)
        self.assertEqual(self.daemon.verbs().count(command_t.JOG), 2)

    def test_a_press_is_known_to_every_page(self):
        self.ended_jog(press=7)
        self.page = self.operator()
        self.refused(7)

    def test_a_jog_has_a_press(self):
        for extra in ({}, {"press": 0}, {"press": 1.5}, {"press": 1, "alive_ms": -1}, {"press": 1, "frame": 5},
                      {"press": 1, "speed_share": "all"}, {"press": 2**53}):
            page = self.operator()
            page.send({"type": "command", "id": 1, "verb": "jog", "joint": 0, "value": 1, "speed": 1, **extra})
            page.until(lambda m: m["type"] == "error")
        self.assertNotIn(command_t.JOG, self.daemon.verbs())

    def test_a_jog_that_nobody_answers_is_said_once(self):
        self.jog(press=1)
        self.page.send({"type": "command", "id": 2, "verb": "reset"})
        self.daemon.until(command_t.RESET, 3)  # this one is said again, and later than the jog
        moves = [one for one in self.daemon.heard if one.verb == command_t.JOG and one.value != 0]
        self.assertEqual(len(moves), 1)


class EndsOfJogs(RulesTest):
    def stops(self):
        return [one for one in self.daemon.heard if one.verb == command_t.JOG and one.value == 0]

    def stopped(self, times=1):
        """The jog was told to stop that often: by a jog of nothing, which cannot stop anything else."""
        jogs = self.daemon.verbs().count(command_t.JOG) - len(self.stops())
        self.daemon.until(command_t.JOG, jogs + times)
        self.assertEqual(len(self.stops()), times)
        self.assertNotIn(command_t.HOLD, self.daemon.verbs())

    def no_program_stopped_before(self, other):
        """Nothing that would stop a program was sent before an emergency stop that is asked for now."""
        other.send({"type": "command", "id": 5, "verb": "estop"})
        self.daemon.until(command_t.ESTOP)
        self.assertFalse({command_t.HOLD, command_t.STOP} & set(self.daemon.verbs()))

    def test_a_jog_ends_with_its_page(self):
        self.accepted_jog()
        self.page.close()
        self.stopped()

    def test_a_jog_of_a_silent_page_ends(self):
        self.accepted_jog()
        self.page.until(lambda m: m["type"] == "message" and m["kind"] == "dead_man")
        self.stopped()
        self.stopped(2)  # and again while it goes on

    def test_a_jog_that_is_accepted_when_its_page_has_gone_ends(self):
        other = self.looker()
        self.jog(press=1)
        command = self.daemon.until(command_t.JOG)
        self.page.close()
        other.until(lambda m: m["type"] == "controls" and m["holder"] == 0)
        self.daemon.said("jogging")
        self.daemon.reply(command)
        self.stopped()

    def test_a_program_that_began_behind_a_jog_is_not_held(self):
        other = self.looker()
        self.jog(press=1)
        command = self.daemon.until(command_t.JOG)
        self.page.close()
        other.until(lambda m: m["type"] == "controls" and m["holder"] == 0)
        self.daemon.reply(command)  # it ended at once, and another client starts a program
        self.daemon.said("running")
        other.state("running")
        self.no_program_stopped_before(other)

    def test_a_refused_jog_holds_nothing(self):
        other = self.looker()
        self.jog(press=1)
        command = self.daemon.until(command_t.JOG)
        self.page.close()
        other.until(lambda m: m["type"] == "controls" and m["holder"] == 0)
        self.daemon.reply(command, outcome=2)
        self.daemon.said("running")
        other.state("running")
        self.no_program_stopped_before(other)

    def test_no_motion_begins_behind_a_jog_that_may_have_to_end(self):
        self.accepted_jog()
        for verb in ("start", "mdi", "home", "resume"):
            answer = self.page.ask(verb, verb, text="G0 X0" if verb == "mdi" else "")
            self.assertEqual(answer["outcome"], "refused", verb)
            self.assertIn("a move by hand goes on", answer["text"])
        self.daemon.said("idle")
        self.page.state("idle")
        self.page.send({"type": "command", "id": 3, "verb": "start"})
        self.daemon.until(command_t.START)

    def test_a_jog_whose_answer_was_lost_ends(self):
        self.jog(press=1)
        self.daemon.until(command_t.JOG)
        self.daemon.said("jogging")
        self.daemon.drop()
        self.assertEqual(self.answer()["outcome"], "unreachable")
        self.daemon.accept()
        self.stopped()

    def test_a_daemon_that_came_anew_jogs_no_more(self):
        self.accepted_jog()
        self.daemon.drop()
        self.daemon.pid, self.daemon.count, self.daemon.state = 2000, 0, "idle"
        self.daemon.accept()
        self.page.state("idle")
        self.page.send({"type": "command", "id": 3, "verb": "start"})
        self.daemon.until(command_t.START)

    def test_only_the_sign_of_life_counts_as_one(self):
        self.accepted_jog(press=1)
        others = ({"type": "take_controls"}, {"type": "command", "id": 2, "verb": "override", "value": 1},
                  {"type": "command", "id": 3, "verb": "jog", "joint": 0, "value": 1, "press": 1})
        new_press = {"type": "command", "id": 4, "verb": "jog", "joint": 0, "value": 1}

        begin, heard = time.monotonic(), []
        while not any(message.get("kind") == "dead_man" for message in heard):
            self.assertLess(time.monotonic() - begin, PATIENCE_S, "other messages keep the jog alive")
            self.page.send((*others, new_press | {"press": 2 + len(heard)})[len(heard) % 4])
            heard.append(self.page.next())
        self.stopped()


class TakeOver(RulesTest):
    def asks(self):
        """A page that asks for the controls, and what both are told."""
        asker = self.looker()
        asker.send({"type": "take_controls"})
        told = [page.until(lambda m: m["type"] == "controls" and m["asker"]) for page in (asker, self.page)]
        self.assertEqual([(one["asker"], one["holder"], one["mine"], one["may_take"]) for one in told],
                         [(told[0]["page"], told[1]["page"], mine, False) for mine in (False, True)])
        self.assertEqual(told[1]["asker_name"], f"page {told[0]['page']}")
        return asker

    def assert_holder(self, page, other):
        """Only this page moves the machine, and both may stop it."""
        for one, outcome in ((page, "accepted"), (other, "refused")):
            one.send({"type": "command", "id": 77, "verb": "reset"})
            if outcome == "accepted":
                self.daemon.reply(self.daemon.until(command_t.RESET))
            answer = one.until(lambda m: m["type"] == "answer" and m["id"] == 77)
            self.assertEqual(answer["outcome"], outcome)
            times = self.daemon.verbs().count(command_t.STOP) + 1
            one.send({"type": "command", "id": 78, "verb": "stop"})
            self.daemon.reply(self.daemon.until(command_t.STOP, times))

    def test_who_asks_has_nothing_yet(self):
        self.assert_holder(self.page, self.asks())

    def test_who_is_given_them_has_them(self):
        asker = self.asks()
        self.page.send({"type": "give_controls"})
        told = asker.until(lambda m: m["type"] == "controls" and m["mine"])
        self.assertEqual(told["asker"], 0)
        self.assert_holder(asker, self.page)

    def test_who_has_them_keeps_them(self):
        asker = self.asks()
        self.page.send({"type": "keep_controls"})
        told = asker.until(lambda m: m["type"] == "message" and m["kind"] == "controls" and "keeps" in m["text"])
        asker.until(lambda m: m["type"] == "controls" and not m["asker"])
        self.assertRegex(told["text"], r"^page \d+ keeps the controls; page \d+ asked\.$")
        self.assert_holder(self.page, asker)

    def test_who_gets_no_answer_takes_them_and_the_move_of_the_other_ends(self):
        self.accepted_jog(press=1, alive_ms=1000)
        asker = self.asks()
        begin, answered = time.monotonic(), 1
        asker.send({"type": "take_controls"})  # too soon
        while not (told := asker.next()).get("may_take"):
            self.assertFalse(told.get("mine"))
            self.page.send({"type": "alive"})
            if (times := self.daemon.verbs().count(command_t.JOG)) > answered:
                answered = times
                self.daemon.reply(self.daemon.until(command_t.JOG))
        self.assertGreater(time.monotonic() - begin, 8)
        self.assertEqual([one.value for one in self.daemon.heard if one.verb == command_t.JOG and one.value == 0], [])
        asker.send({"type": "take_controls"})
        asker.until(lambda m: m["type"] == "controls" and m["mine"])
        deadline = time.monotonic() + PATIENCE_S
        while not [one for one in self.daemon.heard if one.verb == command_t.JOG and one.value == 0]:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)
        self.daemon.said("idle")
        self.assert_holder(asker, self.page)

    def test_a_third_page_waits_its_turn(self):
        asker, third = self.asks(), self.looker()
        third.send({"type": "take_controls"})
        third.until(lambda m: m["type"] == "message" and "asks for the controls already" in m["text"])
        asker.close()
        third.until(lambda m: m["type"] == "controls" and not m["asker"])
        third.take_controls(giver=self.page)

    def test_they_are_free_when_their_page_has_gone_or_gives_them_up(self):
        asker = self.asks()
        self.page.close()
        asker.until(lambda m: m["type"] == "controls" and m["holder"] == 0)
        asker.take_controls()
        asker.send({"type": "give_controls"})
        asker.until(lambda m: m["type"] == "controls" and m["holder"] == 0)

    def test_others_give_and_keep_nothing(self):
        asker, third = self.asks(), self.looker()
        for page in (asker, third):
            for kind in ("give_controls", "keep_controls"):
                page.send({"type": kind})
        self.assert_holder(self.page, asker)


class Programs(RulesTest):
    def load(self, name):
        """What the daemon was asked for; or the refusal."""
        before = self.daemon.verbs().count(command_t.LOAD)
        self.page.send({"type": "command", "id": "load", "verb": "load", "text": name})
        self.page.send({"type": "command", "id": "after", "verb": "hold"})
        self.daemon.reply(self.daemon.until(command_t.HOLD, self.holds + 1))
        self.holds += 1
        asked = [command for command in self.daemon.heard if command.verb == command_t.LOAD][before:]
        if asked:
            self.daemon.reply(asked[0])
        answer = self.answer("load")
        self.assertEqual(answer["outcome"], "accepted" if asked else "refused")
        return asked[0].text if asked else answer["text"]

    def setUp(self):
        super().setUp()
        self.holds = 0
        self.bench.write("outside.ngc", "M2\n")
        self.bench.write("programs/part.ngc", "M2\n")
        os.mkdir(self.bench.path("programs/sub"))
        self.bench.write("programs/sub/part.ngc", "M2\n")
        os.mkdir(self.bench.path("programs2"))
        self.bench.write("programs2/part.ngc", "M2\n")
        os.symlink("part.ngc", self.bench.path("programs/inside"))
        os.symlink("../outside.ngc", self.bench.path("programs/link.ngc"))
        os.symlink("..", self.bench.path("programs/up"))

    def test_those_of_the_folder_are_loaded(self):
        for name, real in (("part.ngc", "part.ngc"), ("sub/part.ngc", "sub/part.ngc"), ("inside", "part.ngc"),
                           ("sub/../part.ngc", "part.ngc"), (self.bench.path("programs/part.ngc"), "part.ngc")):
            self.assertEqual(self.load(name), os.path.realpath(self.bench.path("programs/" + real)), name)

    def test_others_are_not(self):
        for name in ("none.ngc", "../outside.ngc", self.bench.path("outside.ngc"), "link.ngc", "up/outside.ngc",
                     "/etc/passwd", "../programs2/part.ngc", self.bench.path("programs2/part.ngc"), ".", "sub", "/",
                     "/dev/zero", "x" * 5000):
            self.assertEqual(self.load(name), f"there is no program '{name}' in the folder of this panel", name)

    def test_the_list_has_those_that_can_be_loaded(self):
        for name in ("b.nc", "a.gcode", ".hidden.ngc", "tools.tbl", "ngc"):
            self.bench.write("programs/" + name, name)
        os.symlink("part.ngc", self.bench.path("programs/other.ngc"))
        os.mkdir(self.bench.path("programs/folder.ngc"))
        os.utime(self.bench.path("programs/part.ngc"), (1e9, 1e9))
        programs = json.loads(get(self.bench, "/api/v1/programs")[1])
        self.assertEqual([program["name"] for program in programs], ["a.gcode", "b.nc", "other.ngc", "part.ngc"])
        self.assertEqual(programs[-1], {"name": "part.ngc", "size": 3, "modified_s": 1000000000})
        self.assertEqual(get(self.bench, "/api/v1/programs", key=None)[0].status, 401)

    def test_the_loaded_program_is_loaded_again(self):
        self.assertEqual(self.load(""), "")


class Files(RulesTest):
    def test_no_link_is_followed(self):
        os.mkdir(self.bench.path("page/assets"))
        self.bench.write("page/assets/a.js", "1")
        self.assertEqual(get(self.bench, "/assets/a.js")[0].status, 200)
        os.symlink("../machine.toml", self.bench.path("page/machine.toml"))
        os.symlink("index.html", self.bench.path("page/own.html"))
        os.symlink("..", self.bench.path("page/up"))
        os.symlink("assets", self.bench.path("page/other"))
        os.mkfifo(self.bench.path("page/pipe"))
        for path in ("/machine.toml", "/own.html", "/up/machine.toml", "/other/a.js", "/pipe", "/assets", "/assets/"):
            self.assertEqual(get(self.bench, path)[0].status, 404, path)

    def most_memory(self):
        with open(f"/proc/{self.bench.panel.pid}/status", encoding="ascii") as file:
            return next(int(line.split()[1]) * 1024 for line in file if line.startswith("VmHWM"))

    def test_a_long_file_passes_in_pieces(self):
        size = 64 << 20
        with open(self.bench.path("page/long.bin"), "wb") as file:
            file.truncate(size - 5)
            file.seek(size - 5)
            file.write(b"\1\2end")
        get(self.bench, "/")
        before = self.most_memory()
        body = get(self.bench, "/long.bin")[1]
        self.assertEqual((len(body), body[-5:], body.count(0)), (size, b"\1\2end", size - 5))
        if not sanitized(BINARY):  # which keeps what was freed, to find who still reads it
            self.assertLess(self.most_memory() - before, size / 2)


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
