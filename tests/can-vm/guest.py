"""A machine of its own for tests on CAN: Debian's real-time kernel in QEMU, with an initramfs of our programs.

The guest's clock counts its instructions (1 ns each; a pause costs nothing), so what the guest sees of time does not
depend on how busy the host is: a period of 2 ms is 2 ms there, however long it takes here. No KVM needed.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "support"))
from instrumented import sanitized  # noqa: E402

PACKAGE = "linux-image-rt-amd64"
MODULES = ["virtio_pci", "virtio_blk", "can-raw"]  # and what they depend on
TOOLS = ["qemu-system-x86_64", "cpio", "busybox", "candump", "cansend", "ip"]
APPLETS = "sh mount insmod sleep grep seq kill tar dd sync poweroff mkdir cat head tail sed"
# The shell prefers its own applets to a program of the same name; hence /bin/ip.
INIT = """#!/bin/sh
export PATH=/bin LD_LIBRARY_PATH=/lib PYTHONHOME=/usr
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
for m in {modules}; do insmod /modules/$m.ko || echo "$m does not load"; done
/bin/ip link set lo up multicast on; /bin/ip route add 224.0.0.0/4 dev lo
cd /work
sh script > console.log 2>&1
cat console.log
tar c -f - *.log | dd of=/dev/vda bs=64k 2> /dev/null; sync
poweroff -f
"""


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def kernel_folder(cache):
    """The unpacked kernel package, fetched once."""
    if sanitized(cache.parent / "trunnion"):
        skip("the guest's clock counts instructions, and a sanitizer takes ten times as many")
    for tool in TOOLS:
        if not shutil.which(tool):
            skip(f"{tool} is not here")
    if not list(cache.glob("root/boot/vmlinuz-*")):
        cache.mkdir(parents=True, exist_ok=True)
        asked = subprocess.run(["apt-cache", "depends", PACKAGE], capture_output=True, text=True, check=False)
        name = re.search(r"Depends: (linux-image-\S+)", asked.stdout)
        if not name:
            skip(f"no package {PACKAGE}")
        fetch = ["apt-get", "download", "-q", name[1]]
        if subprocess.run(fetch, cwd=cache, capture_output=True, check=False).returncode:
            skip(f"{name[1]} cannot be downloaded")
        deb = next(cache.glob("linux-image-*.deb"))
        subprocess.run(["dpkg", "-x", deb, cache / "root"], check=True)
    return cache / "root"


def with_dependencies(root, modules):
    """Module files in the order in which they load; each names in its .modinfo what it needs."""
    order = []

    def add(name):
        file = next(root.glob(f"lib/modules/*/kernel/**/{name.replace('_', '[_-]')}.ko"))
        needs = re.search(rb"\0depends=([^\0]*)\0", file.read_bytes())[1].decode()
        for need in filter(None, needs.split(",")):
            add(need)
        if file not in order:
            order.append(file)

    for module in modules:
        add(module)
    return order


def libraries(program):
    text = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    return re.findall(r"(/\S+) \(0x", text)


def python_files():
    """Interpreter and every file that a python-can program loads: {place in the guest: file}."""
    ask = ("import sys, can, can.interfaces.socketcan, json, random, signal, struct, subprocess\n"
           "print(*(m.__file__ for m in list(sys.modules.values()) if getattr(m, '__file__', None)), sep='\\n')")
    done = subprocess.run(["/usr/bin/python3", "-c", ask], capture_output=True, text=True, check=False)
    if done.returncode:
        skip("python-can is not here")
    return [pathlib.Path(line) for line in done.stdout.splitlines() if line.startswith("/")]


def add_python(folder):
    for file in python_files():
        target = folder / file.relative_to("/")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, target)
        if ".so" in file.name:
            add_libraries(folder, file)
    (folder / "usr/bin").mkdir(parents=True, exist_ok=True)
    shutil.copy(pathlib.Path("/usr/bin/python3").resolve(), folder / "bin/python3")
    add_libraries(folder, folder / "bin/python3")


def add_libraries(folder, program):
    for library in libraries(program):
        target = folder / ("lib64" if library.startswith("/lib64") else "lib") / pathlib.Path(library).name
        if not target.exists():
            shutil.copy(library, target)


def make_initramfs(folder, root, programs, modules, files, script):
    """`modules`: CAN drivers; `files`: name in /work to text or path; `script`: run there by sh. What it leaves in
    *.log comes back."""
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("bin", "lib", "lib64", "modules", "work", "proc", "sys", "dev", "tmp", "run"):
        (folder / name).mkdir(parents=True)
    for program in [*programs, *map(shutil.which, ("candump", "cansend", "ip"))]:
        shutil.copy(program, folder / "bin")
        add_libraries(folder, program)
    if any(name.endswith(".py") for name in files):
        add_python(folder)
    shutil.copy(shutil.which("busybox"), folder / "bin/busybox")
    for applet in APPLETS.split():
        (folder / "bin" / applet).symlink_to("busybox")
    loaded = with_dependencies(root, MODULES + modules)
    for module in loaded:
        shutil.copy(module, folder / "modules")
    for name, content in {**files, "script": script}.items():
        target = folder / "work" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(content, target) if isinstance(content, pathlib.Path) else target.write_text(content)
    (folder / "init").write_text(INIT.format(modules=" ".join(m.stem for m in loaded)))
    (folder / "init").chmod(0o755)
    archive = folder.with_suffix(".cpio")
    subprocess.run(f"find . | cpio -o -H newc --quiet > '{archive}'", shell=True, cwd=folder, check=True)
    return archive


def boot(work, root, archive, timeout_s=10800):
    """Runs the guest to its end and unpacks what it left into `work`. The two Kvaser cards hang on one bus."""
    disk = work / "out.tar"
    with open(disk, "wb") as file:
        file.truncate(256 << 20)
    command = ["qemu-system-x86_64", "-accel", "tcg,thread=single", "-icount", "shift=0,sleep=off", "-cpu", "max",
               "-smp", "1", "-m", "1024", "-display", "none", "-monitor", "none", "-serial",
               f"file:{work / 'serial.log'}", "-no-reboot", "-nic", "none",
               "-kernel", str(next(root.glob("boot/vmlinuz-*"))), "-initrd", str(archive),
               "-append", "console=ttyS0 quiet panic=-1 rdinit=/init mitigations=off",
               "-drive", f"file={disk},format=raw,if=virtio",
               "-object", "can-bus,id=cb0", "-device", "kvaser_pci,canbus=cb0", "-device", "kvaser_pci,canbus=cb0"]
    subprocess.run(command, timeout=timeout_s, check=True)
    with tarfile.open(disk) as tar:
        tar.extractall(work)
