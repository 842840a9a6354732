"""A daemon that says and answers only what a test tells it to, in the daemon's place for a panel."""
import os
import socket
import sys
import threading

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../support"))
from daemon_socket import acknowledge_t, command_t, packet_of, status_t  # noqa: E402

PATIENCE_S = 30
BEAT_S = 0.02  # a status comes so often, in which the panel sees that the daemon lives


class FakeDaemon:
    """Listens where the panel of `bench` looks for the machine's daemon. `state`, `detour`, `pid` and `count` go into
    the next status; `heard` are the commands in the order in which they came."""

    def __init__(self, bench):
        self.name = bench.name
        self.state, self.detour, self.pid, self.count = "idle", "", 1000, 0
        self.heard = []
        self.changed = threading.Condition()
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.listener.bind(os.path.join(bench.environment["RUNTIME_DIRECTORY"], f"trunnion-{self.name}.sock"))
        self.listener.listen(8)
        self.listener.settimeout(PATIENCE_S)
        self.connection = None
        self.thread = None
        self.ends = False

    def accept(self):
        """Waits for the panel to connect, then speaks with it in a thread."""
        self.connection, _ = self.listener.accept()
        self.connection.settimeout(BEAT_S)
        self.ends = False
        self.thread = threading.Thread(target=self._speak, args=(self.connection,), daemon=True)
        self.thread.start()

    def drop(self):
        """Ends the connection, as a daemon that dies."""
        self.ends = True
        self.thread.join()
        self.connection.close()

    def close(self):
        if self.connection:
            self.drop()
        self.listener.close()

    def _speak(self, connection):
        while not self.ends:
            try:
                self.tell()
                data = connection.recv(70000)
            except TimeoutError:
                continue
            except OSError:
                return
            if not data:
                return
            with self.changed:
                self.heard.append(command_t.decode(data[8:].split(b"\0", 1)[1]))
                self.changed.notify_all()

    def tell(self):
        with self.changed:
            self.count += 1
            status = status_t()
            status.machine, status.state, status.fault, status.axes = self.name, self.state, "ok", "XYZAC"
            status.detour = self.detour
            status.pid, status.count, status.clock_us = self.pid, self.count, self.count
            status.time_us = self.count
            self.connection.send(packet_of(self.name, "status", status.encode()))

    def said(self, state, detour=""):
        """Tells this state from now on; returns the count of the first status that does."""
        with self.changed:
            self.state, self.detour = state, detour
            return self.count + 1

    def reply(self, command, outcome=acknowledge_t.ACCEPTED, message=""):
        with self.changed:
            answer = acknowledge_t()
            answer.client, answer.sequence, answer.outcome = command.client, command.sequence, outcome
            answer.status_count, answer.message = self.count + 1, message
            self.connection.send(packet_of(self.name, "acknowledge", answer.encode()))

    def verbs(self):
        with self.changed:
            return [command.verb for command in self.heard]

    def until(self, verb, times=1):
        """The newest command of this verb, when that many have come."""
        def found():
            return [command for command in self.heard if command.verb == verb]
        with self.changed:
            assert self.changed.wait_for(lambda: len(found()) >= times, PATIENCE_S), f"verb {verb}: {self.heard}"
            return found()[-1]
