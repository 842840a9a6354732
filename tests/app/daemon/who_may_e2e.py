#!/usr/bin/env python3
"""Who may command the daemon, tried as other users, with and without groups, in other namespaces.

usage: who_may_e2e.py TRUNNION_BINARY SOURCE_DIR

Needs root, to be somebody else; exit code 77 (skipped) without. No user or group is made: numbers will do, and the
groups are those that every Debian has.
"""
import os
import shutil
import stat
import subprocess
import sys
import tempfile
import time
import unittest

sys.path[:0] = [os.path.dirname(os.path.abspath(__file__)),
                os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support")]
import daemon_e2e  # noqa: E402
from daemon_e2e import Bench  # noqa: E402
from daemon_socket import DaemonSocket  # noqa: E402

STRANGER, MEMBER = 54321, 54322
DAEMON, BIN, SYS = 1, 2, 3  # groups "daemon", "bin", "sys": look, operate, set up
REFUSED_EXIT, NO_DAEMON_EXIT = 5, 4


class WhoMay(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        os.chmod(self.folder.name, 0o755)
        self.path = os.path.join(self.folder.name, "socket")
        self.binary = shutil.copy(daemon_e2e.BINARY, os.path.join(self.folder.name, "trunnion"))
        os.chmod(self.binary, 0o755)
        self.bench = Bench(machine="cradle_measured", extra=f'[access]\nsocket = "{self.path}"\nlook = "daemon"\n'
                                                            'operate = "bin"\nset_up = "sys"\n')
        self.addCleanup(self.bench.__exit__)
        self.config = shutil.copy(self.bench.config, os.path.join(self.folder.name, "machine.toml"))
        os.chmod(self.config, 0o644)
        self.bench.start_daemon()

    def as_user(self, uid, groups, *arguments, prefix=()):
        """Runs a client as this user; exit code and what it said. A stranger is sure to get no answer."""
        become = ["setpriv", f"--reuid={uid}", f"--regid={uid}",
                  "--groups=" + ",".join(map(str, groups)) if groups else "--clear-groups"]
        patience = ("--timeout", "0.5") if uid == STRANGER else ()
        done = subprocess.run([*become, *prefix, self.binary, *arguments, "--machine", self.config, *patience],
                              capture_output=True, text=True, timeout=120, check=False)
        return done.returncode, done.stdout + done.stderr

    def stands(self):
        self.assertEqual(self.bench.status()["state"], "idle")

    def test_the_socket_is_its_groups_alone(self):
        info = os.stat(self.path)
        self.assertEqual((stat.S_IMODE(info.st_mode), info.st_gid), (0o660, DAEMON))

    def test_the_daemon_of_root_has_three_rights_left(self):
        kept = 1 << 12 | 1 << 14 | 1 << 23  # CAP_NET_ADMIN, CAP_IPC_LOCK, CAP_SYS_NICE
        folder = f"/proc/{self.bench.process.pid}/task"
        for thread in os.listdir(folder):
            with open(f"{folder}/{thread}/status", encoding="ascii") as file:
                status = dict(line.split(":\t", 1) for line in file.read().splitlines() if ":\t" in line)
            for which in ("CapEff", "CapPrm", "CapBnd", "CapInh", "CapAmb"):
                self.assertEqual(int(status[which], 16) & ~kept, 0, f"{which} of {status['Name']}")
            self.assertEqual((status["NoNewPrivs"], status["Seccomp"]), ("1", "2"), status["Name"])

    def test_a_stranger_gets_nowhere(self):
        for groups in ([], [BIN, SYS], [100]):
            for command in (("status",), ("home",), ("estop",), ("mdi", "G0 X1")):
                code, said = self.as_user(STRANGER, groups, *command)
                self.assertEqual(code, NO_DAEMON_EXIT, said)
                self.assertIn("needs group 'daemon'", said)
        self.stands()

    def test_other_namespaces_make_nobody_somebody(self):
        for prefix in (["unshare", "-r"], ["unshare", "-rn"], ["unshare", "-rmpf"]):  # root in a container of his own
            code, said = self.as_user(STRANGER, [], "estop", prefix=prefix)
            if "Operation not permitted" in said and "unshare" in said:
                self.skipTest("namespaces are not allowed here")
            self.assertEqual(code, NO_DAEMON_EXIT, said)
        self.stands()
        code, said = self.as_user(MEMBER, [DAEMON, BIN], "mdi", "G0 X1", "--wait", prefix=[])
        self.assertEqual(code, 0, said)
        done = subprocess.run(["unshare", "-n", self.binary, "mdi", "G0 X2", "--wait", "--machine", self.config],
                              check=False)
        self.assertEqual(done.returncode, 0, "root in another network: the socket is a file")

    def test_a_stranger_starts_no_second_daemon(self):
        become = ["setpriv", f"--reuid={STRANGER}", f"--regid={STRANGER}", "--clear-groups"]
        second = subprocess.run([*become, self.binary, "daemon", "--machine", self.config], capture_output=True,
                                text=True, timeout=120, check=False, cwd=self.folder.name)
        self.assertEqual(second.returncode, 4, second.stderr)
        self.assertIn("is already run", second.stderr)
        self.assertIn("user root", second.stderr)
        self.assertIn(self.path, second.stderr)
        self.stands()

    def test_each_group_may_do_its_part(self):
        look, operate, set_up = [DAEMON], [DAEMON, BIN], [DAEMON, BIN, SYS]
        matrix = [(("status",), look), (("hold",), look), (("override", "0"), look),
                  (("override", "100"), operate), (("mdi", "G0 X1", "--wait"), operate),
                  (("jog", "X", "1", "--wait"), operate), (("home",), operate),
                  (("reset",), operate), (("correction", "geometric", "off"), set_up)]
        for command, needed in matrix:
            for groups in (look, operate, set_up):
                code, said = self.as_user(MEMBER, groups, *command)
                if len(groups) >= len(needed):
                    self.assertNotIn("may not", said, f"{command} with {groups}")
                else:
                    self.assertEqual(code, REFUSED_EXIT, f"{command} with {groups}: {said}")
                    self.assertIn("may not", said)
                if command[0] in ("home", "reset"):
                    self.bench.until(lambda s: s["state"] == "idle")
        log = self.bench.log_text()
        self.assertRegex(log, rf"idle -> running: mdi, by {MEMBER}, process \d+")
        self.assertRegex(log, rf"{MEMBER}, process \d+ is refused 'mdi': no right to operate")

    def test_who_may_only_look_may_stop(self):
        with DaemonSocket(self.bench.name, self.path):
            self.bench.ask("mdi", "G91 G1 X50 F300")
            self.bench.until(lambda s: s["state"] == "running")
            code, said = self.as_user(MEMBER, [DAEMON], "estop")
            self.assertEqual(code, 0, said)
            self.bench.until(lambda s: s["state"] == "estop")
            code, said = self.as_user(MEMBER, [DAEMON], "reset")
            self.assertEqual(code, REFUSED_EXIT, said)
            time.sleep(0.2)
            self.assertEqual(self.bench.status()["state"], "estop")


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("setpriv"):
        print("skipped: only root can be somebody else")
        sys.exit(77)
    daemon_e2e.BINARY, daemon_e2e.SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=[sys.argv[0], "-v"])
