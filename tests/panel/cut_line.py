"""A line between browser and panel that a test cuts: what is sent then is lost, and neither side is told."""
import selectors
import socket
import threading


class CutLine:
    """Listens at `port` of the loopback, and hands everything on to the panel at `target` until it is cut."""

    def __init__(self, target):
        self.target = target
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.is_cut = False
        self.ends = False
        self.other = {}
        self.selector = selectors.DefaultSelector()
        self.selector.register(self.listener, selectors.EVENT_READ)
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def cut(self):
        self.is_cut = True

    def mend(self):
        """New connections pass; those of before the cut stay dead."""
        for line in list(self.other):
            self._drop(line)
        self.is_cut = False

    def close(self):
        self.ends = True
        self.thread.join()
        for line in [self.listener, *self.other]:
            line.close()

    def _accept(self):
        near, _ = self.listener.accept()
        far = socket.create_connection(("127.0.0.1", self.target))
        self.other |= {near: far, far: near}
        for line in (near, far):
            self.selector.register(line, selectors.EVENT_READ)

    def _drop(self, line):
        other = self.other.pop(line, None)
        if other is None:
            return
        self.other.pop(other, None)
        for one in (line, other):
            self.selector.unregister(one)
            one.close()

    def _run(self):
        while not self.ends:
            for key, _ in self.selector.select(0.05):
                if self.is_cut:
                    self._swallow(key.fileobj)
                elif key.fileobj is self.listener:
                    self._accept()
                else:
                    self._pass_on(key.fileobj)

    def _swallow(self, line):
        if line is self.listener:
            self.selector.select(0.05)  # a new connection gets no answer
            return
        try:
            line.recv(65536)
        except OSError:
            pass

    def _pass_on(self, line):
        try:
            data = line.recv(65536)
            if data:
                self.other[line].sendall(data)
                return
        except (OSError, KeyError):
            pass
        self._drop(line)
