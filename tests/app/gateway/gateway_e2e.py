#!/usr/bin/env python3
"""The gateway with a real daemon, over real multicast on this host. The commands are signed by Python's own Ed25519, so
that the gateway is held to somebody else's signatures.

usage: gateway_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Starts itself again in a network of its own; exit code 77 (skipped) where the kernel does not allow that.
TRN_LONG=COUNT: so many hostile datagrams.
"""
import base64
import itertools
import os
import random
import re
import signal
import socket
import statistics
import struct
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "../daemon"), os.path.join(HERE, "../../support")]
import daemon_e2e  # noqa: E402
import ed25519  # noqa: E402
from daemon_e2e import LONG_PROGRAM, Bench  # noqa: E402
from daemon_socket import DaemonSocket, acknowledge_t, command_t, packet_of, signed_command_t  # noqa: E402
from own_network import enter_own_network  # noqa: E402

START, HOLD, STOP, MDI, JOG, OVERRIDE, ESTOP, RESET = 2, 3, 5, 6, 7, 9, 10, 11
WORKING, ACCEPTED, REFUSED = 1, 2, 3
GROUP = ("239.255.76.68", 7668)
SEEDS = {"anna": bytes([1]) * 32, "eve": bytes([2]) * 32}


def sending_socket():
    """Sends to the group over the loopback device, from a port of its own."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
    return made


def group_socket():
    """Hears the group besides."""
    made = sending_socket()
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    made.bind(GROUP)
    made.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                    socket.inet_aton(GROUP[0]) + socket.inet_aton("127.0.0.1"))
    return made


class Site(Bench):
    """A mill with a daemon and a gateway."""

    def __init__(self):
        keys = "".join(f'[[gateway.key]]\nname = "{name}"\npublic = "{self.public(seed)}"\nrole = "{role}"\n'
                       for (name, seed), role in zip(SEEDS.items(), ("operate", "look")))
        super().__init__(machine="mill", extra=f'[gateway]\nurl = "udpm://{GROUP[0]}:{GROUP[1]}?ttl=0"\n'
                                               'counters = "COUNTERS"\n' + keys)
        self.counters = os.path.join(self.folder.name, "state", "counters")
        os.mkdir(os.path.dirname(self.counters))
        with open(self.config, encoding="utf-8") as file:
            text = file.read()
        self.write("machine.toml", text.replace("COUNTERS", self.counters))
        self.gateway = None
        self.number = int(time.time() * 1e6)
        self.socket = group_socket()

    @staticmethod
    def public(seed):
        return base64.b64encode(ed25519.public_key(seed)).decode()

    def start_gateway(self):
        self.gateway_log = os.path.join(self.folder.name, "gateway.log")
        with open(self.gateway_log, "a", encoding="utf-8") as log:
            self.gateway = subprocess.Popen([daemon_e2e.BINARY, "gateway", "--machine", self.config], stderr=log,
                                            stdout=log)
        end = time.time() + 30
        while "signed commands are taken" not in self.gateway_text() and time.time() < end:
            time.sleep(0.01)

    def gateway_text(self):
        with open(self.gateway_log, encoding="utf-8") as file:
            return file.read()

    def __exit__(self, *rest):
        self.socket.close()
        if self.gateway and self.gateway.poll() is None:
            self.gateway.kill()
            self.gateway.wait()
        super().__exit__(*rest)

    def packet(self, verb, sequence, key="anna", value=1.0, text="", client=77, expires_s=20.0):
        """A signed command, in the form that hal/lcm/signed_command_t.lcm describes."""
        inner = command_t()
        inner.client, inner.sequence, inner.verb, inner.value, inner.text = client, sequence, verb, value, text
        inner.expires_us = self.clock_us + int(expires_s * 1e6) if expires_s else 0
        self.number += 1
        message = signed_command_t()
        message.key, message.kind, message.counter = key, signed_command_t.COMMAND, self.number
        message.inner = inner.encode()
        message.size = len(message.inner)
        name = self.name.encode()
        signed = (b"trunnion signed command 1\0" + struct.pack(">I", len(name)) + name + struct.pack(">I", len(key)) +
                  key.encode() + struct.pack(">qBI", message.counter, message.kind, message.size) + message.inner)
        message.signature = ed25519.sign(SEEDS[key], signed)
        return packet_of(self.name, "signed", message.encode())

    def ready(self):
        self.start_daemon()
        self.clock_us = self.status()["clock_us"]
        self.start_gateway()

    def answer(self, packet, sequence, client=77, patience_s=10.0):
        """The final answer, asked for ten times a second with the same datagram; and the time that it took, s."""
        begin = time.time()
        while time.time() - begin < patience_s:
            self.socket.sendto(packet, GROUP)
            again = time.time() + 0.1
            while (left := again - time.time()) > 0:
                self.socket.settimeout(left)
                try:
                    data = self.socket.recv(70000)
                except TimeoutError:
                    break
                channel = f"{self.name}.acknowledge".encode() + b"\0"
                if data[:4] != b"LC02" or not data[8:].startswith(channel):
                    continue
                heard = acknowledge_t.decode(data[8 + len(channel):])
                if (heard.client, heard.sequence) == (client, sequence) and heard.outcome != WORKING:
                    return heard, time.time() - begin
        raise AssertionError("no answer:\n" + self.gateway_text() + self.log_text())


class GatewayTest(unittest.TestCase):
    def test_a_signed_command_moves_the_machine_and_others_do_not(self):
        with Site() as site:
            site.ready()
            self.assertEqual(ACCEPTED, site.answer(site.packet(MDI, 1, text="G21 G91 G0 X3 F1000"), 1)[0].outcome)
            x = site.until(lambda s: s["state"] == "idle") and site.motion()[0]["q_setpoint"][0]
            self.assertAlmostEqual(3, x, delta=0.1)
            # Not signed at all, as a command and as what the gateway hands on.
            bare = command_t()
            bare.client, bare.sequence, bare.verb, bare.text = 5, 1, MDI, "G0 X9"
            for channel in ("command", "signed"):
                site.socket.sendto(packet_of(site.name, channel, bare.encode()), GROUP)
            # Signed by the other key, in this one's name; by a key that may only look; and that one stops.
            honest = site.packet(MDI, 2, text="G0 X9")
            site.socket.sendto(honest[:-1] + bytes([honest[-1] ^ 1]), GROUP)
            refused = site.answer(site.packet(MDI, 3, key="eve", text="G0 X9"), 3)[0]
            self.assertEqual(REFUSED, refused.outcome)
            self.assertIn("role", refused.message)
            self.assertEqual(x, site.motion()[0]["q_setpoint"][0])
            self.assertEqual(ACCEPTED, site.answer(site.packet(ESTOP, 4, key="eve"), 4)[0].outcome)
            site.until(lambda s: s["state"] == "estop")
            # Who gave what stands in both logs.
            self.assertIn("key 'eve' (look): estop", site.gateway_text())

    def test_what_was_heard_cannot_be_sent_again_also_after_a_new_start(self):
        with Site() as site:
            site.ready()
            jog = site.packet(JOG, 1, value=1.0, text="X")
            self.assertEqual(ACCEPTED, site.answer(jog, 1)[0].outcome)
            site.until(lambda s: s["state"] == "idle")
            x = site.motion()[0]["q_setpoint"][0]
            site.gateway.kill()
            site.gateway.wait()
            site.start_gateway()
            for _ in range(20):
                site.socket.sendto(jog, GROUP)
                time.sleep(0.01)
            self.assertEqual(ACCEPTED, site.answer(site.packet(OVERRIDE, 2, value=0.5), 2)[0].outcome)
            self.assertEqual(x, site.motion()[0]["q_setpoint"][0])

    def test_what_was_held_back_over_a_reboot_moves_nothing(self):
        """Before the reboot the computer has run for thirty days; its clock that only runs forward begins anew."""
        uptime = ["unshare", "-T", "--monotonic", "2592000", "--fork", "--kill-child=SIGTERM"]
        if subprocess.run([*uptime, "true"], check=False, capture_output=True).returncode:
            self.skipTest("'unshare -T' is not allowed here")
        with Site() as site:
            binary = daemon_e2e.BINARY
            daemon_e2e.BINARY = site.write("long_ago.sh", f'#!/bin/sh\nexec {" ".join(uptime)} {binary} "$@"\n')
            os.chmod(daemon_e2e.BINARY, 0o700)
            try:
                site.start_daemon()
            finally:
                daemon_e2e.BINARY = binary
            site.clock_us = site.status()["clock_us"]
            self.assertGreater(site.clock_us, 1e6 * (time.time() - 10), "else a reboot sets it back")
            with DaemonSocket.of(site) as local:
                path = local.socket.getpeername()
            held = site.packet(MDI, 2, text="G91 G0 X50", expires_s=1.0)
            site.process.kill()
            site.process.wait()
            end = time.time() + 20
            while os.path.exists(path) and time.time() < end:
                time.sleep(0.05)
            time.sleep(1.5)
            site.start_daemon()
            site.start_gateway()
            x = site.motion()[0]["q_setpoint"][0]
            answer = site.answer(held, 2)[0]
            self.assertEqual((REFUSED, True), (answer.outcome, "too late" in answer.message), answer.message)
            site.clock_us += int(1e6 * 86400)
            answer = site.answer(site.packet(MDI, 3, text="G91 G0 X50"), 3)[0]
            self.assertEqual((REFUSED, True), (answer.outcome, "more than 60 s" in answer.message), answer.message)
            self.assertEqual(x, site.motion()[0]["q_setpoint"][0])

    def test_the_machine_does_not_notice_that_it_dies(self):
        with Site() as site:
            site.ready()
            site.ask("load", site.write("long.ngc", LONG_PROGRAM))
            site.ask("start")
            site.until(lambda s: s["state"] == "running")
            for kill in (signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM):
                site.gateway.send_signal(kill)
                site.gateway.wait()
                self.assertEqual("running", site.status()["state"])
                site.start_gateway()
            site.ask("override", "50")
            self.assertEqual(ACCEPTED, site.answer(site.packet(STOP, 1), 1)[0].outcome)
            site.until(lambda s: s["state"] == "idle")
            self.assertEqual(0, site.status()["starvations"])

    def test_it_has_given_up_its_rights(self):
        with Site() as site:
            site.ready()
            with open(f"/proc/{site.gateway.pid}/status", encoding="ascii") as file:
                status = file.read()
            self.assertRegex(status, r"NoNewPrivs:\t1")
            self.assertRegex(status, r"Seccomp:\t2")
            self.assertRegex(status, r"CapEff:\t0+\n")

    def test_a_flood_hides_no_emergency_stop(self):
        count = int(os.environ.get("TRN_LONG", "20000"))
        rng = random.Random(7)
        with Site() as site:
            site.ready()
            honest = site.packet(MDI, 1, text="G0 X9", expires_s=0)
            pool = [b"", b"LC02", honest[:-1]]
            for _ in range(500):
                data = bytearray(honest)
                for _ in range(rng.randrange(1, 6)):
                    data[rng.randrange(len(data))] = rng.randrange(256)
                pool.append(bytes(data[:rng.randrange(1, len(data) + 1)] if rng.random() < 0.3 else data))
            pool = [data for data in pool if data != honest]
            memory, begin = self.memory_kib(site), time.time()
            flood = os.fork()
            if flood == 0:
                sender = sending_socket()
                for _ in range(count):
                    sender.sendto(rng.choice(pool), GROUP)
                os._exit(0)
            # By what the machine does: who listens to the group would have to hear the whole flood besides.
            took, over = [], False
            with DaemonSocket.of(site) as local:
                for sequence in itertools.count(11):
                    begun, resets = time.time(), itertools.count(1)
                    while not self.comes(local, "idle", 0.1):  # the drives brake before they take a reset
                        self.assertLess(time.time() - begun, 120)
                        local.send(local.command(RESET, next(resets), client=1000 + sequence))
                    packet, asked = site.packet(ESTOP, sequence, key=("anna", "eve")[sequence % 2]), time.time()
                    site.socket.sendto(packet, GROUP)
                    while not self.comes(local, "estop", 0.1):
                        self.assertLess(time.time() - asked, 60, site.gateway_text()[-2000:])
                        site.socket.sendto(packet, GROUP)
                    took.append(1000 * (time.time() - asked))
                    over = os.waitpid(flood, os.WNOHANG)[0] == flood
                    if over:
                        break
            rate = count / (time.time() - begin)
            self.assertEqual("estop", site.status()["state"])
            print(f"{count} hostile datagrams, {rate:.0f} a second; {len(took)} emergency stops took a median of "
                  f"{statistics.median(took):.1f} ms, worst {max(took):.1f} ms", file=sys.stderr)
            self.assertIsNone(site.gateway.poll(), site.gateway_text()[-2000:])
            self.assertLess(self.memory_kib(site), memory + 8192)
            # Nothing of the flood came through.
            self.assertNotIn("mdi", site.log_text().replace("mdi by", ""))

    @staticmethod
    def comes(local, state, patience_s):
        """Whether the daemon tells this state within the time."""
        end = time.time() + patience_s
        while time.time() < end:
            if any(status.state == state for status in local.hear(0.005, "status")):
                return True
        return False

    @staticmethod
    def memory_kib(site):
        with open(f"/proc/{site.gateway.pid}/status", encoding="ascii") as file:
            return int(re.search(r"VmRSS:\s+(\d+)", file.read()).group(1))


if __name__ == "__main__":
    enter_own_network()
    daemon_e2e.BINARY, daemon_e2e.SOURCE = sys.argv[1:3]
    unittest.main(argv=[sys.argv[0], *(f"GatewayTest.{name}" for name in sys.argv[3:])], verbosity=2)
