#!/usr/bin/env python3
"""A real Prometheus scrapes a panel over TLS with the key of a file, and promtool has nothing against the form.

usage: prometheus_test.py TRUNNION_BINARY SOURCE_DIR

Exit code 77 (skipped) where there is no Prometheus.
"""
import json
import os
import shutil
import socket
import subprocess
import sys
import time
import unittest
import urllib.error
import urllib.request

from page_client import get
from panel_bench import PanelBench

BINARY, SOURCE = "", ""
KEY = "0123456789abcdef" * 2
PATIENCE_S = 60


class Scraped(unittest.TestCase):
    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE)
        self.addCleanup(self.bench.close)
        key = self.bench.write("scraper.key", KEY + "\n", 0o600)
        self.bench.start_panel_with_log_in("--key-file", key)

    def metrics(self):
        answer, body = get(self.bench, "/metrics", key=KEY)
        self.assertEqual(answer.status, 200)
        return body.decode()

    def test_promtool_has_nothing_against_the_form(self):
        deadline = time.monotonic() + PATIENCE_S
        while "trunnion_joint_position" not in (text := self.metrics()):
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.1)
        done = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def ask(self, port, query):
        """The value of a query; None while there is none."""
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/query?query={query}", timeout=5) as answer:
                found = json.load(answer)["data"]["result"]
        except (urllib.error.URLError, ConnectionError):
            return None
        return found[0]["value"][1] if found else None

    def until(self, port, query, wanted):
        deadline = time.monotonic() + PATIENCE_S
        while (value := self.ask(port, query)) != wanted:
            self.assertLess(time.monotonic(), deadline, f"{query} is {value} and never {wanted}")
            time.sleep(0.2)

    def test_a_real_one_scrapes_it(self):
        with socket.socket() as line:
            line.bind(("127.0.0.1", 0))
            port = line.getsockname()[1]
        config = self.bench.write("prometheus.yml", f"""
global: {{scrape_interval: 500ms}}
scrape_configs:
  - job_name: mill
    scheme: https
    authorization: {{credentials_file: {self.bench.path("scraper.key")}}}
    tls_config: {{ca_file: {self.bench.path("tls.crt")}, server_name: localhost}}
    static_configs: [{{targets: ["127.0.0.1:{self.bench.port}"]}}]
""")
        with subprocess.Popen(["prometheus", f"--config.file={config}",
                               f"--storage.tsdb.path={self.bench.path('tsdb')}",
                               f"--web.listen-address=127.0.0.1:{port}"],
                              stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, env=self.bench.environment) as prometheus:
            try:
                self.until(port, "up", "1")
                self.until(port, "trunnion_up", "1")
                self.until(port, 'trunnion_state%7Bstate="idle"%7D', "1")
                subprocess.run([BINARY, "estop", "--machine", self.bench.config], check=True, capture_output=True,
                               env=self.bench.environment)
                self.until(port, 'trunnion_state%7Bstate="estop"%7D', "1")
            finally:
                prometheus.kill()


if __name__ == "__main__":
    if not shutil.which("prometheus") or not shutil.which("promtool"):
        sys.exit(77)
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
