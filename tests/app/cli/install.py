#!/usr/bin/python3
"""usage: install.py TRUNNION SOURCE_DIR

What is installed works where it stands: program, configs, examples, and the service that names them.
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest


class InstallTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.prefix = pathlib.Path(cls.folder.name, "opt")
        cls.install("--prefix", cls.prefix)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @staticmethod
    def install(*options, **environment):
        command = ["cmake", "--install", pathlib.Path(BINARY).parent, *options]
        subprocess.run(command, check=True, capture_output=True, env={"PATH": "/usr/bin:/bin", **environment})

    def test_examples_run_on_configs_with_other_files_beside_them(self):
        share = self.prefix / "share/trunnion"
        for config, example in (("cradle", "impeller"), ("cradle_can", "cone_frustum"), ("micro_stage", "micro_ring")):
            command = [self.prefix / "bin/trunnion", "run", share / f"examples/{example}.ngc", "--machine",
                       share / f"configs/{config}.toml", "--tools", share / "examples/tools.tbl", "--stop-after", "1"]
            done = subprocess.run(command, capture_output=True, text=True, cwd=self.folder.name)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("every joint within its limits", done.stdout)

    def test_the_service_starts_the_installed_program(self):
        for name, command in (("trunnion", "daemon"), ("trunnion-gateway", "gateway"), ("trunnion-panel", "panel"),
                              ("trunnion-mqtt", "mqtt")):
            unit = (self.prefix / f"lib/systemd/system/{name}@.service").read_text()
            self.assertIn(f"ExecStart={self.prefix}/bin/trunnion {command}", unit)

    def test_a_package_is_made_below_destdir_and_names_the_final_place(self):
        root = pathlib.Path(self.folder.name, "package")
        self.install("--prefix", "/usr", DESTDIR=str(root))
        self.assertTrue((root / "usr/bin/trunnion").is_file())
        self.assertEqual((root / "usr/lib/systemd/system/trunnion@.service").read_text(),
                         (SOURCE / "packaging/trunnion@.service").read_text())

    def test_documents_come_along(self):
        found = {path.name for path in (self.prefix / "share/doc/trunnion").rglob("*")}
        self.assertLessEqual({"README.md", "operator.md", "drives.md", "copyright"}, found)


if __name__ == "__main__":
    BINARY, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
    unittest.main(argv=[sys.argv[0], "-v"])
