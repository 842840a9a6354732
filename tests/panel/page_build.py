#!/usr/bin/env python3
"""What the page is made of and when: exact versions, a lock file that names no host, and no second build where nothing
changed. npm is a stand-in here that notes how it was called: nothing comes from a network.

usage: page_build.py SOURCE_DIR
"""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = ""
NPM = """#!/bin/sh
echo "npm $*" >>"$CALLS"
mkdir -p node_modules/.bin
echo 'echo tsc "$@" >>"$CALLS"' >node_modules/.bin/tsc
cat >node_modules/.bin/vite <<'END'
#!/bin/sh
echo "vite $*" >>"$CALLS"
for out; do :; done
mkdir -p "$out" && echo made >"$out/index.html"
END
chmod +x node_modules/.bin/*
touch node_modules/.package-lock.json
"""


class Versions(unittest.TestCase):
    def read(self, name):
        with open(os.path.join(SOURCE, "panel/page", name), encoding="utf-8") as file:
            return json.load(file)

    def test_are_exact(self):
        package = self.read("package.json")
        for name, version in (package["dependencies"] | package["devDependencies"]).items():
            self.assertRegex(version, r"^\d+\.\d+\.\d+$", name)

    def test_the_lock_has_each_with_its_hash_and_no_host(self):
        packages = self.read("package-lock.json")["packages"]
        for name, package in packages.items():
            if not name:
                continue
            self.assertRegex(package["version"], r"^\d+\.\d+\.\d+", name)
            self.assertTrue(package["integrity"].startswith("sha512-"), name)
        text = json.dumps(packages)
        self.assertIsNone(re.search(r"\w+://", text))
        self.assertNotIn("resolved", text)

    def test_the_lock_is_that_of_the_package(self):
        package, root = self.read("package.json"), self.read("package-lock.json")["packages"][""]
        for part in ("dependencies", "devDependencies"):
            self.assertEqual(package[part], root[part])


class Builds(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = folder.name
        shutil.copytree(os.path.join(SOURCE, "panel"), self.path("panel"),
                        ignore=shutil.ignore_patterns("node_modules"))
        os.mkdir(self.path("docs"))
        shutil.copy(os.path.join(SOURCE, "docs/faults.md"), self.path("docs"))
        os.mkdir(self.path("bin"))
        for name, text in (("npm", NPM), ("node", "#!/bin/sh\n")):
            with open(self.path(f"bin/{name}"), "w", encoding="ascii") as file:
                os.fchmod(file.fileno(), 0o755)
                file.write(text)

    def path(self, name):
        return os.path.join(self.root, name)

    def build(self):
        """The tools that were called."""
        calls = self.path("calls")
        open(calls, "w", encoding="ascii").close()
        subprocess.run([self.path("panel/build.sh"), self.path("out")], check=True, capture_output=True,
                       env={"PATH": f"{self.path('bin')}:/usr/bin:/bin", "CALLS": calls}, timeout=60)
        with open(calls, encoding="ascii") as file:
            return [line.split()[0] for line in file]

    def change(self, name):
        """Makes the file newer than all that was built, whatever the clock's step is."""
        newest = max(os.stat(self.path(one)).st_mtime for one in ("out/index.html",
                                                                  "panel/page/node_modules/.package-lock.json"))
        os.utime(self.path(name), (newest + 5, newest + 5))

    def test_once_and_again_where_something_changed(self):
        self.assertEqual(self.build(), ["npm", "tsc", "vite", "vite"])
        self.assertEqual(self.build(), [])
        for name in ("panel/page/src/app.tsx", "panel/page/index.html", "panel/build.sh", "docs/faults.md"):
            self.change(name)
            self.assertEqual(self.build(), ["tsc", "vite", "vite"], name)
            os.utime(self.path(name), (1, 1))
            self.assertEqual(self.build(), [], name)

    def test_other_packages_are_got(self):
        self.build()
        self.change("panel/page/package-lock.json")
        self.assertEqual(self.build(), ["npm", "tsc", "vite", "vite"])

    def test_without_npm_it_says_what_is_missing(self):
        os.remove(self.path("bin/npm"))
        os.symlink("/bin/bash", self.path("bin/bash"))
        for tool in ("readlink", "dirname", "find", "env"):
            os.symlink(shutil.which(tool), self.path(f"bin/{tool}"))
        done = subprocess.run([self.path("panel/build.sh"), self.path("out")], check=False, capture_output=True,
                              text=True, env={"PATH": self.path("bin")}, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("apt-get install nodejs npm", done.stderr)


class Packages(unittest.TestCase):
    """What scripts/setup.sh would install where dpkg knows no package."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.command("dpkg-query")

    def command(self, name):
        with open(os.path.join(self.folder, name), "w", encoding="ascii") as file:
            os.fchmod(file.fileno(), 0o755)
            file.write("#!/bin/sh\n")

    def missing(self, who):
        """Those of the page."""
        done = subprocess.run(["/bin/bash", "-c", f". scripts/setup.sh; missing_packages {who}"], cwd=SOURCE,
                              check=True, capture_output=True, text=True, env={"PATH": self.folder}, timeout=60)
        self.assertIn("cmake", done.stdout.split())
        return [name for name in done.stdout.split() if name in ("nodejs", "npm", "chromium")]

    def test_are_got_by_who_needs_them(self):
        self.assertEqual(self.missing("build"), [])
        self.assertEqual(self.missing("panel"), ["nodejs", "npm"])
        self.assertEqual(self.missing("test"), ["nodejs", "npm", "chromium"])

    def test_a_command_from_elsewhere_does_as_well(self):
        self.command("node")
        self.assertEqual(self.missing("panel"), ["npm"])
        self.command("npm")
        self.command("chromium")
        self.assertEqual(self.missing("test"), [])


if __name__ == "__main__":
    SOURCE = os.path.abspath(sys.argv[1])
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
