"""A page made of the standard library: REST and WebSocket."""
import base64
import http.client
import json
import os
import socket
import ssl
import struct
import time

PATIENCE_S = 120  # an instrumented server takes its time


def connect(bench):
    """A connection to the panel of `bench`, with TLS where its address says so."""
    line = socket.create_connection(("127.0.0.1", bench.port), timeout=PATIENCE_S)
    if not bench.origin.startswith("https"):
        return line
    context = ssl.create_default_context(cafile=bench.path("tls.crt"))
    return context.wrap_socket(line, server_hostname="localhost")


def log_in(bench, name, password=None, **extra):
    """The answer to a log-in, its text, and the cookie that it sets."""
    body = json.dumps({"name": name, "password": f"{name}'s password" if password is None else password}).encode()
    answer, text = post(bench, "/api/v1/log_in", body, key=None, **extra)
    return answer, text.decode(), (answer.getheader("set-cookie") or "").partition(";")[0]


class Page:
    """A WebSocket client of the panel of `bench`. `status_line` tells what the server said to the handshake, and
    `closed` with which code and reason it has closed."""

    def __init__(self, bench, key="right", origin=None, host=None, path="/api/v1/stream", cookie=None):
        self.socket = connect(bench)
        self.closed = None
        nonce = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET {path} HTTP/1.1\r\nHost: {host or bench.host}\r\n"
                             f"Origin: {origin or bench.origin}\r\n"
                             "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                             + (f"Cookie: {cookie}\r\n" if cookie else "") +
                             f"Sec-WebSocket-Key: {nonce}\r\nSec-WebSocket-Protocol: trunnion-1\r\n\r\n").encode())
        self.file = self.socket.makefile("rb")
        self.status_line = self.file.readline().decode()
        while self.file.readline() not in (b"\r\n", b""):
            pass
        if key is not None and cookie is None and " 101 " in self.status_line:
            self.send({"type": "key", "key": bench.key if key == "right" else key})

    def close(self):
        self.file.close()
        self.socket.close()

    def send(self, message):
        data = (message if isinstance(message, str) else json.dumps(message)).encode()
        size = struct.pack(">BB", 0x81, 0x80 | len(data)) if len(data) < 126 else struct.pack(
            ">BBH", 0x81, 0xFE, len(data))
        self.socket.sendall(size + b"\0\0\0\0" + data)

    def next(self):
        """The next message, or None when the server has closed."""
        head = self.file.read(2)
        if len(head) < 2:
            return None
        size = head[1] & 127
        if size == 126:
            size, = struct.unpack(">H", self.file.read(2))
        elif size == 127:
            size, = struct.unpack(">Q", self.file.read(8))
        body = self.file.read(size)
        if head[0] & 15 == 8:
            self.closed = (struct.unpack(">H", body[:2])[0], body[2:].decode()) if size >= 2 else (1005, "")
            return None
        return json.loads(body)

    def until(self, wanted):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            message = self.next()
            assert message is not None, f"the server closed: {self.closed}"
            if wanted(message):
                return message
        raise AssertionError("never came")

    def until_closed(self):
        """What came before."""
        heard, end = [], time.monotonic() + PATIENCE_S
        while (message := self.next()) is not None:
            heard.append(message)
            assert time.monotonic() < end, "the server does not close"
        return heard

    def state(self, name):
        return self.until(lambda m: m["type"] == "status" and m["state"] == name)

    def ask(self, number, verb, **values):
        self.send({"type": "command", "id": number, "verb": verb, **values})
        return self.until(lambda m: m["type"] == "answer" and m["id"] == number)

    def take_controls(self, giver=None):
        """Where another page has them, `giver` gives them."""
        self.send({"type": "take_controls"})
        if giver:
            giver.until(lambda m: m["type"] == "controls" and m["asker"])
            giver.send({"type": "give_controls"})
        self.until(lambda m: m["type"] == "controls" and m["mine"])


def ask(bench, method, path, headers, body=None):
    """The answer and its body."""
    connection = http.client.HTTPConnection("127.0.0.1", bench.port, timeout=PATIENCE_S)
    connection.sock = connect(bench)
    connection.request(method, path, body=body, headers=headers)
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    return answer, text


def get(bench, path, host=None, key="right", scheme="Bearer", cookie=None):
    """The answer and its body."""
    headers = {"Host": host or bench.host} | ({"Cookie": cookie} if cookie else {})
    if key is not None and cookie is None:
        headers["Authorization"] = f"{scheme} {bench.key if key == 'right' else key}"
    return ask(bench, "GET", path, headers)


def post(bench, path, text, host=None, key="right", origin="own", size=None, cookie=None):
    """The answer and its body. `size` is told instead of the text's own."""
    headers = {"Host": host or bench.host, "Content-Length": str(len(text) if size is None else size)}
    if key is not None and cookie is None:
        headers["Authorization"] = f"Bearer {bench.key if key == 'right' else key}"
    if cookie:
        headers["Cookie"] = cookie
    if origin is not None:
        headers["Origin"] = bench.origin if origin == "own" else origin
    return ask(bench, "POST", path, headers, text)
