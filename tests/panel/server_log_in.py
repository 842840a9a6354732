#!/usr/bin/env python3
"""A panel that others reach over a network: TLS, users with roles, sessions that end, and who gets nothing.

usage: server_log_in.py TRUNNION_BINARY SOURCE_DIR
"""
import json
import os
import pty
import re
import socket
import ssl
import subprocess
import sys
import time
import unittest

from fake_daemon import FakeDaemon, command_t
from page_client import Page, get, log_in, post
from panel_bench import PanelBench

BINARY, SOURCE = "", ""
NO_VISITOR = 4401
KEY = "0123456789abcdef" * 2


class LogInTest(unittest.TestCase):
    options = ()

    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE, daemon=False)
        self.addCleanup(self.bench.close)
        self.daemon = FakeDaemon(self.bench)
        self.addCleanup(self.daemon.close)
        self.line = self.bench.start_panel_with_log_in(*self.options)
        self.daemon.accept()

    def session(self, name):
        answer, text, cookie = log_in(self.bench, name)
        self.assertEqual((answer.status, text), (200, "Logged in.\n"))
        return cookie

    def who(self, cookie):
        """Who has logged in, as the panel tells the page."""
        answer, body = get(self.bench, "/api/v1/session", key=None, cookie=cookie)
        self.assertEqual(answer.status, 200)
        return json.loads(body)

    def sent(self, **who):
        """The answer's code to a program that is sent."""
        return post(self.bench, "/api/v1/programs/a.ngc", b"M2\n", **who)[0].status

    def page(self, name, cookie=None):
        page = Page(self.bench, cookie=cookie or self.session(name))
        self.addCleanup(page.close)
        page.state("idle")
        return page


class Sessions(LogInTest):
    def test_the_cookie_is_out_of_reach(self):
        self.assertRegex(self.line, r": https://127\.0\.0\.1:\d+/$")
        answer, _, cookie = log_in(self.bench, "otto")
        self.assertRegex(cookie, r"^__Host-trunnion-panel_test=[0-9a-f]{64}$")
        parts = {part.strip() for part in answer.getheader("set-cookie").split(";")[1:]}
        self.assertEqual(parts, {"Path=/", "Max-Age=43200", "HttpOnly", "Secure", "SameSite=Strict"})
        self.assertEqual(self.who(cookie), {"log_in": True, "name": "otto", "role": "operate"})
        self.assertNotEqual(cookie, self.session("otto"))  # every log-in is a session of its own

    def test_without_a_session_there_are_files_only(self):
        self.assertEqual(get(self.bench, "/", key=None)[0].status, 200)
        right = self.session("sara")
        name, _, token = right.partition("=")
        for cookie in (None, name + "=", f"{name}={token[:-1]}", f"{name}={'0' * 64}", "x" + right, token):
            self.assertEqual(self.who(cookie), {"log_in": True, "name": "", "role": ""})
            for path in ("machine", "state", "plan", "programs", "nothing"):
                self.assertEqual(get(self.bench, f"/api/v1/{path}", key=None, cookie=cookie)[0].status, 401, cookie)
            self.assertEqual(get(self.bench, "/metrics", key=None, cookie=cookie)[0].status, 401)
            page = Page(self.bench, key=None, cookie=cookie)
            self.addCleanup(page.close)
            self.assertEqual((page.until_closed(), page.closed), ([], (NO_VISITOR, "Log in first.")))
        self.assertEqual(get(self.bench, "/api/v1/state", cookie="a=b; " + right)[0].status, 200)

    def test_a_key_opens_no_stream(self):
        page = Page(self.bench, key=KEY)
        self.addCleanup(page.close)
        self.assertEqual((page.until_closed(), page.closed), ([], (NO_VISITOR, "Log in first.")))

    def test_wrong_names_and_passwords(self):
        for name, password in (("otto", "sara's password"), ("nobody", "x" * 12), ("otto", "")):
            answer, text, cookie = log_in(self.bench, name, password)
            self.assertEqual(answer.status, 401 if password else 400, text)
            self.assertEqual(cookie, "")

    def test_too_many_wrong_ones_are_not_looked_at(self):
        codes = [log_in(self.bench, "otto", "wrong password")[0].status for _ in range(7)]
        self.assertEqual(codes, [401] * 5 + [429] * 2)
        self.assertEqual(log_in(self.bench, "sara")[0].status, 429)  # of this address, whoever it says it is

    def test_the_right_one_forgets_wrong_ones(self):
        for _ in range(2):
            for _ in range(4):
                self.assertEqual(log_in(self.bench, "otto", "wrong password")[0].status, 401)
            self.session("otto")

    def test_others_do_not_wait_while_passwords_are_compared(self):
        page = self.page("otto")
        page.take_controls()
        lines = [ssl_post(self.bench, {"name": "otto", "password": "wrong password"}) for _ in range(4)]
        begin = time.monotonic()
        page.send({"type": "command", "id": 1, "verb": "estop"})
        self.daemon.until(command_t.ESTOP)
        took = time.monotonic() - begin
        for line in lines:
            self.assertIn(b" 401 ", line.recv(100))
            line.close()
        self.assertLess(took, max(0.1, (time.monotonic() - begin) / 5), "one of the four would take a quarter")

    def test_log_out_ends_pages(self):
        cookie = self.session("otto")
        page = self.page("otto", cookie)
        refused, _ = post(self.bench, "/api/v1/log_out", b"", cookie=cookie, origin="https://evil.example")
        self.assertEqual(refused.status, 403)
        self.assertEqual(self.who(cookie)["name"], "otto")
        answer, _ = post(self.bench, "/api/v1/log_out", b"", cookie=cookie)
        self.assertEqual(answer.status, 200)
        self.assertIn("Max-Age=0", answer.getheader("set-cookie"))
        page.until_closed()
        self.assertEqual(page.closed[0], NO_VISITOR)
        self.assertEqual(self.who(cookie)["name"], "")

    def test_a_user_who_is_removed_is_out(self):
        page = self.page("otto")
        page.take_controls()
        self.assertEqual(self.bench.user("remove", "otto").returncode, 0)
        page.until_closed()
        self.assertEqual(page.closed, (NO_VISITOR, "This session is over: log in again."))
        self.assertEqual(log_in(self.bench, "otto")[0].status, 401)
        self.page("sara")

    def test_a_file_that_is_not_sound_lets_nobody_in(self):
        page = self.page("sara")
        with open(self.bench.path("users"), "a", encoding="utf-8") as file:
            file.write("nonsense\n")
        page.until_closed()
        self.assertEqual(log_in(self.bench, "sara")[0].status, 401)

    def test_a_file_that_others_may_read_lets_nobody_in(self):
        page = self.page("sara")
        os.chmod(self.bench.path("users"), 0o644)
        page.until_closed()
        self.assertEqual(log_in(self.bench, "sara")[0].status, 401)
        os.chmod(self.bench.path("users"), 0o600)
        time.sleep(2)  # it looks twice a second, and tries that are refused would keep her out
        self.page("sara")


def ssl_post(bench, message):
    """Sends a log-in and does not wait for its answer."""
    body = json.dumps(message).encode()
    context = ssl.create_default_context(cafile=bench.path("tls.crt"))
    line = context.wrap_socket(socket.create_connection(("127.0.0.1", bench.port), timeout=30),
                               server_hostname="localhost")
    line.sendall(f"POST /api/v1/log_in HTTP/1.1\r\nHost: {bench.host}\r\nOrigin: {bench.origin}\r\n"
                 f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
    return line


class Short(LogInTest):
    options = ("--session-hours", str(3 / 3600))

    def test_a_session_ends(self):
        cookie = self.session("otto")
        page = self.page("otto", cookie)
        page.take_controls()
        page.send({"type": "command", "id": 1, "verb": "jog", "joint": 0, "value": 1, "alive_ms": 1000, "press": 1})
        command = self.daemon.until(command_t.JOG)
        self.daemon.said("jogging")
        self.daemon.reply(command)
        for _ in range(100):
            try:
                page.send({"type": "alive"})
            except OSError:
                pass  # closed; why is read below
            if page.next() is None:
                break
            time.sleep(0.1)
        self.assertEqual(page.closed, (NO_VISITOR, "This session is over: log in again."))
        # Its move ends with it.
        deadline = time.monotonic() + 10
        while not [one for one in self.daemon.heard if one.verb == command_t.JOG and one.value == 0]:
            self.assertLess(time.monotonic(), deadline, "the jog goes on")
            time.sleep(0.02)
        self.assertEqual(get(self.bench, "/api/v1/state", cookie=cookie)[0].status, 401)


class Roles(LogInTest):
    def test_who_looks_stops_and_nothing_else(self):
        page = self.page("lara")
        page.send({"type": "take_controls"})
        page.until(lambda m: m["type"] == "message" and m["text"] == "Your role is to look, not to operate.")
        for verb in ("start", "resume", "mdi", "reset", "home"):
            answer = page.ask(verb, verb)
            self.assertEqual((answer["outcome"], answer["text"]),
                             ("refused", "your role is 'look', and this needs 'operate'"))
        for verb in ("hold", "stop", "estop"):
            page.send({"type": "command", "id": verb, "verb": verb})
            self.daemon.until(getattr(command_t, verb.upper()))
        self.assertEqual(self.sent(cookie=self.session("lara")), 403)

    def test_who_operates_does_not_set_up(self):
        for name in ("otto", "sara"):
            page = self.page(name)
            page.take_controls()
            page.send({"type": "command", "id": 1, "verb": "correction", "text": "screw", "value": 1})
            if name == "otto":
                answer = page.until(lambda m: m["type"] == "answer")
                self.assertEqual(answer["text"], "your role is 'operate', and this needs 'set up'")
                page.close()
        self.daemon.until(command_t.CORRECTION)
        self.assertEqual(self.daemon.verbs(), [command_t.CORRECTION])
        cookie = self.session("otto")
        self.assertEqual(self.sent(cookie=cookie), 200)

    def test_the_history_says_who_did_what(self):
        page = self.page("otto")
        page.take_controls()
        page.send({"type": "command", "id": 1, "verb": "mdi", "text": "G0 X1"})
        self.daemon.until(command_t.MDI)
        told = json.loads(get(self.bench, "/api/v1/history", cookie=self.session("lara"))[1])
        self.assertIn(("did", "otto: mdi G0 X1"), [(one["kind"], one["text"]) for one in told])


class Pages(LogInTest):
    def test_other_origins_are_refused(self):
        cookie = self.session("sara")
        for origin in ("https://evil.example", self.bench.origin.replace("https", "http"), "null"):
            page = Page(self.bench, cookie=cookie, origin=origin)
            self.addCleanup(page.close)
            self.assertIn(" 403 ", page.status_line)
            self.assertEqual(self.sent(cookie=cookie, origin=origin), 403)
            self.assertEqual(log_in(self.bench, "sara", origin=origin)[0].status, 403)
        self.assertEqual(log_in(self.bench, "sara", origin=None)[0].status, 403)

    def test_plain_http_gets_nothing(self):
        for request in (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"\x16\x03\x01\x00\x05hello", b"\0" * 500):
            with socket.create_connection(("127.0.0.1", self.bench.port), timeout=30) as line:
                line.sendall(request)
                answer = b""
                try:
                    while data := line.recv(1000):
                        answer += data
                except ConnectionResetError:
                    pass
            self.assertNotIn(b"HTTP", answer)
        self.page("otto")

    def test_old_tls_gets_nothing(self):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.load_verify_locations(self.bench.path("tls.crt"))
        context.minimum_version, context.maximum_version = ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1
        context.set_ciphers("ALL:@SECLEVEL=0")
        with socket.create_connection(("127.0.0.1", self.bench.port), timeout=30) as line:
            with self.assertRaises((ssl.SSLError, ConnectionResetError)):
                context.wrap_socket(line, server_hostname="localhost")


class Programs(LogInTest):
    @property
    def options(self):
        return ("--key-file", self.bench.write("scraper.key", KEY + "\n", 0o600))

    def test_a_key_looks(self):
        self.assertEqual(get(self.bench, "/metrics", key=KEY)[0].status, 200)
        self.assertEqual(get(self.bench, "/metrics", key=KEY[::-1])[0].status, 401)
        self.assertEqual(self.sent(key=KEY), 403)


class Starts(unittest.TestCase):
    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE, daemon=False)
        self.addCleanup(self.bench.close)
        self.bench.make_certificate()

    def start(self, *options):
        done = subprocess.run([BINARY, "panel", "--machine", self.bench.config, "--page", self.bench.path("page"),
                               *options], capture_output=True, text=True, timeout=60, env=self.bench.environment,
                              check=False)
        self.assertNotIn("http", done.stdout)
        self.assertNotEqual(done.returncode, 0)
        return done.stderr

    def tls(self):
        return ("--cert", self.bench.path("tls.crt"), "--key", self.bench.path("tls.key"))

    def test_off_the_loopback_only_with_tls_and_users(self):
        for place in ("0.0.0.0:0", "192.0.2.1:8470"):
            self.assertIn("with TLS and a log-in only", self.start("--listen", place))
        self.assertIn("needs both --cert and --key", self.start("--listen", "0.0.0.0:0", *self.tls()[:2]))
        self.assertIn("No such file", self.start("--listen", "0.0.0.0:0", *self.tls()))
        self.bench.write("users", "", 0o600)
        self.assertIn("nobody may log in", self.start("--listen", "0.0.0.0:0", *self.tls(), "--users",
                                                      self.bench.path("users")))
        self.assertIn("is no address", self.start("--listen", "example.com:1"))

    def test_files_that_are_no_secret(self):
        self.bench.user("add", "otto", "--role", "look", password="long enough")
        users = ("--users", self.bench.path("users"))
        os.chmod(self.bench.path("tls.key"), 0o644)
        self.assertIn("chmod o=", self.start(*self.tls(), *users))
        os.chmod(self.bench.path("tls.key"), 0o600)
        os.chmod(self.bench.path("users"), 0o640)
        self.assertIn("chmod 600", self.start(*self.tls(), *users))

    def test_a_certificate_of_another_key(self):
        self.bench.user("add", "otto", "--role", "look", password="long enough")
        os.rename(self.bench.path("tls.key"), self.bench.path("old.key"))
        os.rename(self.bench.path("tls.crt"), self.bench.path("old.crt"))
        self.bench.make_certificate()
        self.assertIn("cannot listen", self.start("--cert", self.bench.path("old.crt"), "--key",
                                                  self.bench.path("tls.key"), "--users", self.bench.path("users"),
                                                  "--listen", "127.0.0.1:0"))


class Users(unittest.TestCase):
    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE, daemon=False)
        self.addCleanup(self.bench.close)

    def test_are_added_listed_and_removed(self):
        for name, role in (("otto", "operate"), ("sara", "set up")):
            self.assertEqual(self.bench.user("add", name, "--role", role, password="a long one").stdout,
                             f"{name} may {role}.\n")
        self.assertEqual(os.stat(self.bench.path("users")).st_mode & 0o777, 0o600)
        self.assertEqual(re.sub(" +", " ", self.bench.user("list").stdout), "otto operate\nsara set up\n")
        with open(self.bench.path("users"), encoding="utf-8") as file:
            text = file.read()
        self.assertEqual(len(re.findall(r"(?m)^\w+:[\w ]+:\$argon2id\$v=19\$m=65536,", text)), 2)
        self.assertNotIn("a long one", text)
        again = self.bench.user("add", "otto", "--role", "look", password="a long one")
        self.assertEqual(again.returncode, 4)
        self.assertIn("there is a user 'otto'", again.stderr)
        self.assertEqual(self.bench.user("remove", "otto").returncode, 0)
        self.assertEqual(self.bench.user("remove", "otto").returncode, 4)
        self.assertNotIn("otto", self.bench.user("list").stdout)

    def test_what_is_refused(self):
        for name, role, password, why in (("a b", "look", "a long one", "is no name"),
                                          ("a:b", "look", "a long one", "is no name"),
                                          ("otto", "look", "short", "a password has"),
                                          ("otto", "boss", "a long one", "boss")):
            done = self.bench.user("add", name, "--role", role, password=password)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(why, done.stderr)
        self.assertFalse(os.path.exists(self.bench.path("users")))

    def test_a_typed_password_is_not_shown(self):
        manager, terminal = pty.openpty()
        with subprocess.Popen([BINARY, "panel", "user", "add", "otto", "--role", "look", "--users",
                               self.bench.path("users")], stdin=terminal, stdout=terminal, stderr=terminal,
                              env=self.bench.environment) as process:
            os.close(terminal)
            shown = b""
            for question in (b"Password for otto: ", b"The same again: "):
                while question not in shown:
                    shown += os.read(manager, 1000)
                time.sleep(0.3)  # until the terminal shows nothing any more
                os.write(manager, b"a secret one\n")
            process.wait(timeout=30)
            shown += os.read(manager, 1000)
        self.assertEqual(process.returncode, 0, shown)
        self.assertNotIn(b"secret", shown)


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
