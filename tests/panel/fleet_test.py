#!/usr/bin/env python3
"""Every machine that the LCM network shows is shown by a panel; what else comes from that network shows nothing.

usage: fleet_test.py TRUNNION_BINARY SOURCE_DIR

Starts itself again in a network of its own (LCM); exit code 77 (skipped) where the kernel does not allow that.
"""
import os
import socket
import sys
import time
import unittest

from page_client import Page
from panel_bench import PanelBench

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../support"))
from daemon_socket import packet_of, status_t  # noqa: E402
from own_network import enter_own_network  # noqa: E402

BINARY, SOURCE = "", ""
GROUP, PORT = "239.255.76.67", 7667
URL = f"udpm://{GROUP}:{PORT}?ttl=0"


class Network(unittest.TestCase):
    def setUp(self):
        self.benches = [PanelBench(BINARY, SOURCE, name=name, lcm_url=URL) for name in ("mill_a", "mill_b")]
        for bench in self.benches:
            self.addCleanup(bench.close)
        self.benches[0].start_panel("--page-of", "mill_b=https://mill-b.example:8470")
        self.page = Page(self.benches[0])
        self.addCleanup(self.page.close)

    def fleet(self, wanted):
        """The machines by name, when they are as wanted."""
        def machines(message):
            return {one["name"]: one for one in message["machines"]}
        return machines(self.page.until(lambda m: m["type"] == "fleet" and wanted(machines(m))))

    def send(self, data):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            line.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            line.sendto(data, (GROUP, PORT))

    def status(self, name, machine=None):
        status = status_t()
        status.machine = name if machine is None else machine
        status.state = "running"
        self.send(packet_of(name, "status", status.encode()))

    def test_both_are_shown_and_one_that_dies_is_not_heard(self):
        both = self.fleet(lambda all_of: len(all_of) == 2 and all(one["state"] == "idle" for one in all_of.values()))
        self.assertEqual(sorted(both), ["mill_a", "mill_b"])
        self.assertTrue(both["mill_a"]["heard"] and both["mill_b"]["heard"])
        self.assertEqual((both["mill_a"]["page"], both["mill_b"]["page"]), ("", "https://mill-b.example:8470"))
        self.assertEqual(both["mill_b"]["host"], "this computer")
        self.benches[1].daemon.kill()
        self.benches[1].daemon.wait()
        left = self.fleet(lambda all_of: not all_of["mill_b"]["heard"])
        self.assertTrue(left["mill_a"]["heard"])

    def test_what_is_no_status_shows_nothing(self):
        self.fleet(lambda all_of: len(all_of) == 2)
        self.status("x", machine="y")
        for data in (b"", b"LC02", b"LC02\0\0\0\1x.status\0" + b"\xff" * 500, os.urandom(60000)):
            self.send(data)
        self.status("good")
        self.assertEqual(sorted(self.fleet(lambda all_of: "good" in all_of)), ["good", "mill_a", "mill_b"])

    def test_a_flood_of_names_is_bounded(self):
        for i in range(1000):
            self.status(f"m{i}")
            if i % 50 == 0:
                time.sleep(0.02)
        shown = self.fleet(lambda all_of: len(all_of) > 100)
        self.assertLessEqual(len(self.fleet(lambda all_of: len(all_of) >= len(shown))), 200)
        self.page.send({"type": "command", "id": 1, "verb": "hold"})
        self.page.until(lambda m: m["type"] == "answer" and m["id"] == 1)  # the panel still works


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    enter_own_network()
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
