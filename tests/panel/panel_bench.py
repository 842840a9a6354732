"""A daemon on simulated drives and its panel, with nothing that another test has: folders, machine, sockets and port
are their own."""
import os
import re
import shutil
import subprocess
import tempfile

PATIENCE_S = 60


class PanelBench:
    """`folder` goes with `close`; `origin` and `key` are what the panel printed. `extra`: at the config's end."""

    def __init__(self, binary, source, daemon=True, tools=None, config="cradle", name="panel_test", lcm_url="",
                 extra=""):
        self.binary, self.source = binary, source
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = self.temporary.name
        self.name, self.lcm_url = name, lcm_url
        self.machine, self.extra = config, extra
        self.environment = self._environment()
        self.config = self._config()
        os.mkdir(self.path("page"))
        os.mkdir(self.path("programs"))
        self.write("page/index.html", "<p>the page</p>")
        self.daemon = self.panel = None
        self.origin = self.key = None
        if daemon:
            # A copy: the daemon writes into its table.
            self.start_daemon(*(("--tools", shutil.copy(tools, self.folder)) if tools else ()))

    def _environment(self):
        """Nothing of the caller's but the way to programs."""
        out = {"PATH": os.environ["PATH"], "LANG": "C.UTF-8", "TRUNNION_TIMEOUT": "30"}
        for name in ("HOME", "TMPDIR", "XDG_RUNTIME_DIR", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_STATE_HOME",
                     "RUNTIME_DIRECTORY", "STATE_DIRECTORY"):
            out[name] = self.path(name.lower())
            os.mkdir(out[name], mode=0o700)
        return out

    def _config(self):
        """A shipped config under a name of its own, whose drives may be late; telemetry only as told."""
        with open(os.path.join(self.source, "configs", self.machine + ".toml"), encoding="utf-8") as file:
            text, named = re.subn(r'(?m)^name = "\w+"', f'name = "{self.name}"', file.read(), count=1)
        assert named == 1 and "[lcm]" not in text
        # What the config names by its path, as networks and tables, lies beside it.
        for entry in os.listdir(os.path.join(self.source, "configs")):
            if not entry.endswith(".toml"):
                os.symlink(os.path.join(self.source, "configs", entry), self.path(entry))
        if "[realtime]" not in text:
            text += "\n[realtime]\nlate_periods_max = 0\n"
        return self.write("machine.toml", text + f'\n[lcm]\nurl = "{self.lcm_url}"\n' + self.extra)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text, mode=0o644):
        path = self.path(name)
        with open(path, "w", encoding="utf-8") as file:
            os.fchmod(file.fileno(), mode)
            file.write(text)
        return path

    def start_daemon(self, *options):
        with open(self.path("daemon.log"), "w", encoding="utf-8") as log:
            self.daemon = subprocess.Popen([self.binary, "daemon", "--machine", self.config, *options], stdout=log,
                                           stderr=log, env=self.environment, cwd=self.folder)

    def make_certificate(self):
        """A certificate that names this computer's loopback and signs itself."""
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
                        "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
                        "subjectAltName=IP:127.0.0.1,DNS:localhost",
                        "-keyout", self.path("tls.key"), "-out", self.path("tls.crt")], check=True,
                       capture_output=True, env=self.environment)
        os.chmod(self.path("tls.key"), 0o600)

    def user(self, verb, *arguments, password=""):
        """Runs `trunnion panel user`, which reads the password from its standard input here."""
        return subprocess.run([self.binary, "panel", "user", verb, *arguments, "--users", self.path("users")],
                              input=password + "\n", text=True, capture_output=True, env=self.environment,
                              check=False)

    def start_panel_with_log_in(self, *options, page=None, listen="127.0.0.1:0"):
        self.make_certificate()
        for name, role in (("lara", "look"), ("otto", "operate"), ("sara", "set up")):
            self.user("add", name, "--role", role, password=name + "'s password").check_returncode()
        return self.start_panel("--listen", listen, "--cert", self.path("tls.crt"), "--key", self.path("tls.key"),
                                "--users", self.path("users"), *options, page=page)

    def start_panel(self, *options, page=None):
        """Returns what it printed when it listens."""
        self.panel = subprocess.Popen(
            [self.binary, "panel", "--machine", self.config,
             *(() if "--listen" in options else ("--listen", "127.0.0.1:0")), "--page",
             page or self.path("page"), "--programs", self.path("programs"), *options],
            stdout=subprocess.PIPE, text=True, env=self.environment, cwd=self.folder)
        line = self.panel.stdout.readline()
        found = re.search(r"(https?://[\d.]+:\d+)/(?:#key=([0-9a-f]{32}))?$", line.strip())
        assert found, f"the panel printed '{line}'"
        self.origin, self.key = found.groups()
        return line

    @property
    def host(self):
        return self.origin.partition("://")[2]

    @property
    def port(self):
        return int(self.origin.rpartition(":")[2])

    def close(self):
        for process in (self.panel, self.daemon):
            if not process:
                continue
            process.terminate()
            try:
                process.wait(timeout=PATIENCE_S)
            finally:
                process.kill()
                process.wait()
        if self.panel:
            self.panel.stdout.close()
        self.temporary.cleanup()
