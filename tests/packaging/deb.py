#!/usr/bin/python3
"""usage: deb.py TRUNNION SOURCE BUILD

The Debian packages of BUILD: what is in them, and what lintian says. With TRN_LONG they are installed, upgraded over a
changed config and purged in a fresh Debian 12 (debootstrap), and a program runs there. Exit code 77 (skipped) where the
page is not built, or where there is no dpkg.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

MULTIARCH = subprocess.run(["gcc", "-print-multiarch"], capture_output=True, text=True, check=True).stdout.strip()

# What lintian says and why it stays. Everything else is an error.
ALLOWED = {
    "maintscript-calls-ldconfig": "CPack writes it for every library; the trigger, which would do, is there as well",
    "initial-upload-closes-no-bugs": "Debian has no request for this package",
}

LIBRARY = ("libtrunnion0.2", "trunnion-dev", "python3-trunnion")


def run(*command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command}: exit {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done.stdout


def make_packages(folder):
    """The packages by their names."""
    run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", folder)
    return {run("dpkg-deb", "-f", path, "Package").strip(): path for path in sorted(pathlib.Path(folder).glob("*.deb"))}


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.packages = make_packages(cls.folder.name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def files(self, package):
        listed = run("dpkg-deb", "-c", self.packages[package])
        found = ((re.search(r" \.(/\S*?)(?: -> .*)?$", line), line) for line in listed.splitlines())
        return {match.group(1): line for match, line in found if match}

    def test_what_is_where(self):
        self.assertEqual(set(self.packages),
                         {"trunnion", "trunnion-dev", "trunnion-panel", "libtrunnion0.2", "python3-trunnion"})
        program = self.files("trunnion")
        for path in ("/usr/bin/trunnion", "/usr/bin/trunnion-drives", "/etc/trunnion/mill.toml",
                     "/usr/lib/systemd/system/trunnion@.service", "/usr/lib/systemd/system/trunnion-mqtt@.service",
                     "/usr/lib/sysusers.d/trunnion.conf",
                     "/usr/lib/tmpfiles.d/trunnion.conf", "/usr/lib/udev/rules.d/60-trunnion.rules",
                     "/usr/share/man/man1/trunnion-run.1.gz", "/usr/share/trunnion/machine.schema.json",
                     "/usr/share/bash-completion/completions/trunnion", "/usr/share/trunnion/examples/impeller.ngc"):
            self.assertIn(path, program)
        self.assertIn("/usr/share/trunnion/panel/index.html", self.files("trunnion-panel"))
        development = self.files("trunnion-dev")
        for path in ("/usr/include/trunnion/status_t.hpp", "/usr/share/trunnion/lcm/command_t.lcm",
                     f"/usr/lib/{MULTIARCH}/cmake/Trunnion/TrunnionConfig.cmake",
                     "/usr/include/trunnion/trunnion.h", f"/usr/lib/{MULTIARCH}/libtrunnion.so"):
            self.assertIn(path, development)
        everything = [set(self.files(package)) for package in self.packages]
        self.assertEqual({path for path in set.intersection(*everything) if not path.endswith("/")}, set())
        for listed in map(self.files, self.packages):
            for path, line in listed.items():
                self.assertIn(" root/root ", line, path)

    def test_conffiles(self):
        listed = run("dpkg-deb", "-I", self.packages["trunnion"], "conffiles")
        self.assertEqual(listed.split(), ["/etc/trunnion/mill.toml"])

    def test_size(self):
        for package, most_kb in (("trunnion", 5000), ("trunnion-panel", 500), ("trunnion-dev", 100),
                                 ("libtrunnion0.2", 3000), ("python3-trunnion", 300)):
            kb = self.packages[package].stat().st_size / 1000
            print(f"{self.packages[package].name}: {kb:.0f} kB, installed "
                  f"{run('dpkg-deb', '-f', self.packages[package], 'Installed-Size').strip()} KiB")
            self.assertLess(kb, most_kb, package)

    @unittest.skipUnless(shutil.which("lintian"), "lintian is not here")
    def test_lintian(self):
        command = ["lintian", "--allow-root", "--tag-display-limit", "0", *map(str, self.packages.values())]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        said = [line for line in done.stdout.splitlines() if line[:2] in ("E:", "W:")]
        self.assertEqual([line for line in said if line.split()[2] not in ALLOWED], [])

    def test_a_program_finds_the_messages(self):
        root = pathlib.Path(self.folder.name, "root")
        run("dpkg-deb", "-x", self.packages["trunnion-dev"], root)
        source = pathlib.Path(self.folder.name, "client")
        source.mkdir()
        (source / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(client CXX)\nfind_package(Trunnion 0.2 REQUIRED)\n"
            "add_executable(client main.cc)\ntarget_link_libraries(client Trunnion::messages)\n"
            "message(STATUS \"messages ${Trunnion_MESSAGES}\")\n")
        (source / "main.cc").write_text(
            "#include <trunnion/status_t.hpp>\n#include <cstdio>\nint main() {\n  trunnion::status_t told{};\n"
            "  told.machine = \"mill\";\n  char bytes[65536];\n  const int n = told.encode(bytes, 0, sizeof bytes);\n"
            "  trunnion::status_t heard;\n  heard.decode(bytes, 0, n);\n  std::puts(heard.machine.c_str());\n}\n")
        said = run("cmake", "-S", source, "-B", source / "build", f"-DCMAKE_PREFIX_PATH={root}/usr")
        self.assertTrue(list(pathlib.Path(re.search(r"messages (\S+)", said).group(1)).glob("*.lcm")))
        run("cmake", "--build", source / "build")
        self.assertEqual(run(source / "build/client"), "mill\n")


class Tree:
    """A fresh Debian 12 in a folder, with /proc and /dev of this computer."""

    def __init__(self, folder):
        self.root = pathlib.Path(folder, "debian")
        base = os.environ.get("TRN_DEBOOTSTRAP")  # a tree that debootstrap made before
        if base:
            run("cp", "-a", base, self.root)
        else:
            run("debootstrap", "--variant=minbase", "bookworm", self.root)
        (self.root / "usr/sbin/policy-rc.d").write_text("#!/bin/sh\nexit 101\n")
        (self.root / "usr/sbin/policy-rc.d").chmod(0o755)
        for name in ("proc", "dev"):
            run("mount", "--rbind", f"/{name}", self.root / name)

    def close(self):
        for name in ("proc", "dev"):
            run("umount", "-l", self.root / name)

    def run(self, *command, user=None):
        switch = ["setpriv", "--reuid", user, "--regid", user, "--init-groups"] if user else []
        return run("chroot", self.root, "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8",
                   "DEBIAN_FRONTEND=noninteractive", *switch, *command)

    def install(self, *paths, options=()):
        for path in paths:
            shutil.copy(path, self.root / "root")
        names = [f"/root/{pathlib.Path(path).name}" for path in paths]
        return self.run("apt-get", "install", "-y", "-q", "--no-install-recommends", *options, *names)


def newer(package, folder, change):
    """The same package with a higher version, after `change` has worked on its unpacked tree."""
    tree = pathlib.Path(folder, "newer")
    run("dpkg-deb", "-R", package, tree)
    control = tree / "DEBIAN/control"
    control.write_text(control.read_text().replace("0.2.0-1", "0.2.0-2"))
    change(tree)
    out = pathlib.Path(folder, package.name.replace("0.2.0-1", "0.2.0-2"))
    run("dpkg-deb", "--root-owner-group", "-b", tree, out)
    return out


# What happens in a booted copy, a line "WHAT: OUTCOME" each.
DAY = r"""
useradd -G trunnion machinist
systemctl start trunnion@mill trunnion-panel@mill
printf 'G21 G90\nG0 X5\nG53 G1 X0 F600\nM2\n' >/tmp/cut.ngc
as() { runuser -u "$1" -- sh -c "$2" >/tmp/out 2>&1; echo $?; }
say() { echo "SAID $1: $2"; }
sleep 2
say machine "$(systemctl is-active trunnion@mill)"
say panel "$(systemctl is-active trunnion-panel@mill)"
say 'operator homes, loads and starts' "$(as machinist 'cp /tmp/cut.ngc /var/lib/trunnion/programs &&
  trunnion home --wait && trunnion load /var/lib/trunnion/programs/cut.ngc && trunnion start --wait &&
  trunnion touch-off X -3')"
cat /tmp/out
say 'nobody stops' "$(as nobody 'trunnion stop')"
say 'nobody reads what is kept' "$(as nobody 'cat /var/lib/trunnion/mill.var')"
ask() { exec 3<>/dev/tcp/127.0.0.1/8470; printf 'GET /api/v1/state HTTP/1.1\r\nHost: 127.0.0.1:8470\r\n%s\r\n' "$1" >&3
  timeout 5 head -n 1 <&3 | tr -d '\r'; exec 3>&-; }
say 'the page with the key' "$(ask "Authorization: Bearer $(cat /var/lib/trunnion-panel/mill/key)"$'\r\n')"
say 'the page without' "$(ask '')"
say 'complaints about udev rules' "$(journalctl -b --no-pager | grep -c '60-trunnion.rules')"
say exposure "$(systemd-analyze security trunnion@mill | sed -n 's/.*exposure level for .*: \([0-9.]*\) .*/\1/p')"
systemctl stop trunnion@mill
say stopped "$(systemctl show -P Result trunnion@mill)"
systemctl start trunnion@mill
sleep 1
say 'the offset after a restart' "$(trunnion offset | tr '\n' ' ')"
journalctl -o cat --no-pager -u trunnion@mill -u trunnion-panel@mill | tail -n 40
"""


class Computer:
    """A copy of a tree that is booted in QEMU, with Debian's kernel and systemd."""

    def __init__(self, tree, folder):
        tree.run("apt-get", "install", "-y", "-q", "--no-install-recommends", "linux-image-cloud-amd64",
                 "initramfs-tools", "systemd-sysv")
        self.root, self.image = pathlib.Path(folder, "booted"), pathlib.Path(folder, "disk")
        run("cp", "-ax", tree.root, self.root)
        self.kernel, self.start = (next((self.root / "boot").glob(name)) for name in ("vmlinuz-*", "initrd.img-*"))

    def said(self, script):
        """The lines that the script says on the console, as root of the booted copy."""
        (self.root / "root/day.sh").write_text(script)
        unit = ("[Unit]\nAfter=multi-user.target\n[Service]\nType=oneshot\nStandardOutput=tty\nStandardError=tty\n"
                "TTYPath=/dev/ttyS0\nExecStart=/bin/bash /root/day.sh\nExecStopPost=/usr/bin/systemctl poweroff\n"
                "[Install]\nWantedBy=graphical.target\n")
        (self.root / "etc/systemd/system/day.service").write_text(unit)
        run("chroot", self.root, "systemctl", "enable", "day.service")
        run("chroot", self.root, "systemctl", "mask", "serial-getty@ttyS0.service")  # it would take the console over
        run("mke2fs", "-q", "-t", "ext4", "-d", self.root, self.image, "2500M")
        done = subprocess.run(
            ["qemu-system-x86_64", "-accel", "tcg", "-m", "1024", "-smp", "2", "-display", "none", "-serial", "stdio",
             "-no-reboot", "-kernel", self.kernel, "-initrd", self.start,
             "-append", "root=/dev/vda rw console=ttyS0 quiet", "-nic", "none",
             "-drive", f"file={self.image},format=raw,if=virtio"],
            capture_output=True, text=True, timeout=900, check=True, stdin=subprocess.DEVNULL, errors="replace")
        print(done.stdout[-4000:])
        return [line[5:] for line in done.stdout.replace("\r", "").splitlines() if line.startswith("SAID ")]


@unittest.skipUnless(os.environ.get("TRN_LONG"), "TRN_LONG is not set")
@unittest.skipUnless(shutil.which("debootstrap") and os.geteuid() == 0, "needs debootstrap, and root")
class FreshDebian(unittest.TestCase):
    """One day in the life of an installation, in the order of the steps."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.packages = make_packages(pathlib.Path(cls.folder.name, "debs"))
        cls.tree = Tree(cls.folder.name)
        cls.addClassCleanup(cls.folder.cleanup)
        cls.addClassCleanup(cls.tree.close)
        cls.tree.run("apt-get", "update", "-q")

    def test_1_install_and_cut(self):
        begin = time.monotonic()
        self.tree.install(self.packages["trunnion"])
        installed = time.monotonic() - begin
        said = self.tree.run("trunnion", "run", "impeller")
        print(f"apt install: {installed:.1f} s; to the end of the first motion: {time.monotonic() - begin:.1f} s")
        self.assertIn("every joint within its limits", said)
        self.assertRegex(self.tree.run("trunnion", "--version"), r"^trunnion 0\.2\.0 \(")
        self.assertIn("trunnion", self.tree.run("getent", "group", "trunnion"))
        self.assertIn("/var/lib/trunnion", self.tree.run("getent", "passwd", "trunnion"))
        self.tree.install(self.packages["trunnion-panel"])

    def test_2_the_unit_s_commands_work_as_its_user(self):
        unit = (self.tree.root / "usr/lib/systemd/system/trunnion@.service").read_text().replace("%i", "mill")
        rights = self.tree.run("stat", "-c", "%U:%G %a", "/var/lib/trunnion", "/var/lib/trunnion/programs")
        self.assertEqual(rights.splitlines(), ["trunnion:trunnion 750", "trunnion:trunnion 2770"])
        self.tree.run("install", "-d", "-o", "trunnion", "-g", "trunnion", "-m", "750", "/run/trunnion/mill")
        before, start = (re.search(rf"^{key}=(.*)$", unit, re.M).group(1) for key in ("ExecStartPre", "ExecStart"))
        script = (f"export RUNTIME_DIRECTORY=/run/trunnion/mill; umask 027; {before}; {start} & daemon=$!; "
                  "timeout 60 sh -c 'until trunnion status >/dev/null 2>&1; do sleep 0.1; done'; "
                  "trunnion home --wait && trunnion load /var/lib/trunnion/programs/part.ngc && "
                  "trunnion start --wait && trunnion tool 3 Z 50.2 && trunnion touch-off X 3; "
                  "code=$?; kill $daemon; wait $daemon; exit $code")
        self.tree.run("sh", "-c", "printf 'G21 G90\\nG0 X5\\nG1 X0 F600\\nM2\\n' >/var/lib/trunnion/programs/part.ngc",
                      user="trunnion")
        self.tree.run("sh", "-c", script, user="trunnion")
        self.assertIn("T3", (self.tree.root / "var/lib/trunnion/mill.tbl").read_text())
        self.assertTrue((self.tree.root / "var/lib/trunnion/mill.var").exists())

    @unittest.skipUnless(shutil.which("qemu-system-x86_64"), "qemu is not here")
    def test_3_the_units_under_systemd(self):
        """A copy of the tree is booted."""
        said = Computer(self.tree, self.folder.name).said(DAY)
        told = dict(line.split(": ", 1) for line in said if ": " in line)
        self.assertEqual(told["machine"], "active")
        self.assertEqual(told["panel"], "active")
        self.assertEqual(told["operator homes, loads and starts"], "0")
        self.assertNotEqual(told["nobody stops"], "0")
        self.assertNotEqual(told["nobody reads what is kept"], "0")
        self.assertIn("200 OK", told["the page with the key"])
        self.assertIn("401", told["the page without"])
        self.assertEqual(told["complaints about udev rules"], "0")
        self.assertEqual(told["stopped"], "success")
        self.assertRegex(told["the offset after a restart"], r"> G54 +3\.0000 ")
        self.assertLessEqual(float(told["exposure"]), 2)

    def test_4_upgrade_keeps_what_the_user_changed(self):
        config = self.tree.root / "etc/trunnion/mill.toml"
        mine = config.read_text().replace("velocity_mm_s = 400.0", "velocity_mm_s = 123.0")
        config.write_text(mine)
        shutil.copy(config, config.with_name("own.toml"))

        def change(tree):
            path = tree / "etc/trunnion/mill.toml"
            path.write_text(path.read_text() + "\n# newer\n")
        self.tree.install(newer(self.packages["trunnion"], self.folder.name, change),
                          *(self.packages[name] for name in LIBRARY),
                          options=("-o", "Dpkg::Options::=--force-confdef", "-o", "Dpkg::Options::=--force-confold",
                                   "--allow-change-held-packages"))
        self.assertIn("0.2.0-2", self.tree.run("dpkg-query", "-W", "trunnion"))
        self.assertEqual(config.read_text(), mine)
        self.assertIn("newer", config.with_name("mill.toml.dpkg-dist").read_text())
        self.assertTrue((self.tree.root / "var/lib/trunnion/mill.tbl").exists())
        said = self.tree.run("trunnion", "run", "probe", "--machine", "/etc/trunnion/mill.toml")
        self.assertIn("within its limits", said)

    def test_5_the_library_plans(self):
        said = self.tree.run("python3", "/usr/share/trunnion/examples/library/limits.py", "/etc/trunnion/mill.toml",
                             "/usr/share/trunnion/examples/first_part.ngc", "/usr/share/trunnion/examples/tools.tbl")
        self.assertRegex(said, r"s on mill\nX: ")

    def test_6_purge(self):
        said = self.tree.run("apt-get", "purge", "-y", "-q", "trunnion", "trunnion-panel", *LIBRARY)
        self.assertIn("Removing trunnion", said)
        left = {str(path.relative_to(self.tree.root)) for part in ("usr", "etc", "var/lib")
                for path in (self.tree.root / part).rglob("*trunnion*")
                if not str(path).startswith(f"{self.tree.root}/var/lib/dpkg")}
        # The user's own config and program, and nothing else.
        self.assertEqual(left, {"etc/trunnion", "var/lib/trunnion"})
        names = lambda folder: [path.name for path in (self.tree.root / folder).rglob("*")]
        self.assertEqual(names("etc/trunnion"), ["own.toml"])
        self.assertEqual(names("var/lib/trunnion"), ["programs", "part.ngc"])


if __name__ == "__main__":
    SOURCE, BUILD = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]).resolve()
    if not (BUILD / "panel/index.html").exists() or not shutil.which("dpkg-shlibdeps"):
        print("the page is not built, or dpkg-shlibdeps is not here")
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[4:]])
