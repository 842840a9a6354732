#!/usr/bin/python3
"""Runs daemon and drives over SocketCAN: on a virtual CAN and between two emulated Kvaser controllers.

Run by hand; needs qemu-system-x86, busybox-static, cpio, can-utils and tshark.

usage: can_vm.py BUILD_DIR SOURCE_DIR [vcan] [kvaser]

Boots Debian's real-time kernel in QEMU (no KVM needed) with an initramfs made of the programs of BUILD_DIR. In the
guest the daemon homes the cradle and cuts a part on five emulated drives; the bus is recorded with candump. Then, on
this side: the setpoints on the bus are those of `trunnion run`, bit for bit; tshark finds no malformed frame; SYNC
periods are summed up. Exit code 77 (skipped) where QEMU or the kernel package cannot be had.
"""
import collections
import csv
import math
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tarfile

PACKAGE = "linux-image-rt-amd64"
MODULES = ["virtio", "virtio_ring", "virtio_pci_legacy_dev", "virtio_pci_modern_dev", "virtio_pci", "virtio_blk",
           "can", "can-raw", "can-dev"]
DRIVERS = {"vcan": ["vcan"], "kvaser": ["sja1000", "kvaser_pci"]}  # each takes the name can0
PROGRAM = """G21 G90 G94 G17
T1 M6
G0 Z200
G0 X30 Y0 A-20 C0
G4 P0.1
G43.4 H1
G64 P0.01 R0.05
G1 X30 Y0 Z60 F2500
G1 X10 Y12 Z58 A-18 C40
G1 X-20 Y20 Z60 A-15 C90
G3 X-30 Y10 I0 J-10 F1500
G0 Z100
G49
M2
"""
PERIOD_S = 0.005  # the emulated processor takes this long for what a real one does in 0.1 ms
FIRST_LINE = 6  # behind the dwell: before it, the way depends on where homing ended
# The shell prefers its own applets to a program of the same name; hence /bin/ip.
INIT = """#!/bin/sh
export PATH=/bin:/sbin LD_LIBRARY_PATH=/lib
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev; mkdir -p /tmp /run
for m in {modules}; do insmod /modules/$m.ko 2>/dev/null; done
/bin/ip link set lo up multicast on; /bin/ip route add 224.0.0.0/4 dev lo
{bus}
/bin/ip -details link show can0
candump -L can0 > /tmp/bus.log &
cd /work
trunnion-drives --machine vm.toml --can {drives_on} --priority 60 > /tmp/drives.log 2>&1 &
trunnion daemon --machine vm.toml --tools tools.tbl --record /tmp/daemon.csv > /tmp/daemon.log 2>&1 &
daemon=$!
ask() {{ echo "--- $*"; trunnion "$@" --machine vm.toml --timeout 20; echo "exit $?"; }}
(
for i in $(seq 1 60); do trunnion status --machine vm.toml --timeout 2 | grep -q idle && break; sleep 0.5; done
ask home --wait --patience 300
ask load part.ngc
ask start --wait --patience 900
ask status --json
) > /tmp/client.log 2>&1
kill -TERM $daemon; wait $daemon
echo "daemon exit $?" >> /tmp/client.log
sleep 0.5
cat /tmp/client.log /tmp/drives.log /tmp/daemon.log; ls -l /dev/vda
cp /work/vm.toml /tmp; cd /tmp; sync
tar c bus.log drives.log daemon.csv daemon.log client.log vm.toml | dd of=/dev/vda bs=64k; sync
poweroff -f
"""
BUS = {
    "vcan": ("/bin/ip link add dev can0 type vcan; /bin/ip link set can0 txqueuelen 1000 up", "can0"),
    "kvaser": ("for c in can0 can1; do /bin/ip link set $c type can bitrate 1000000 restart-ms 100; "
               "/bin/ip link set $c txqueuelen 100 up; done", "can1"),
}


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def kernel_folder(cache):
    """The unpacked kernel package, fetched once."""
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


def libraries(program):
    text = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    return re.findall(r"(/\S+) \(0x", text)


def vm_config(source):
    """The shipped config; in an emulated processor the clock is coarse, so nothing counts as late but what is lost."""
    text = (source / "configs/cradle_can.toml").read_text()
    text = text.replace("period_s = 0.002", f"period_s = {PERIOD_S}")
    text = text.replace("heartbeat_timeout_ms = 150", "heartbeat_timeout_ms = 20000")
    text = text.replace("missed_max = 3", "missed_max = 100\noverload_max = 100\nsdo_timeout_ms = 20000\n"
                        "boot_timeout_ms = 60000\nenable_timeout_s = 20.0")
    text = text.replace("[drives]", "[realtime]\nlate_periods_max = 0\n\n[drives]")
    return text + "\n[drives.emulation]\nsync_periods_max = 10000\n"


def build_initramfs(folder, build, source, root, bus):
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("bin", "lib", "lib64", "modules", "work/eds", "proc", "sys", "dev", "tmp"):
        (folder / name).mkdir(parents=True)
    programs = [build / "trunnion", build / "trunnion-drives", shutil.which("candump"), shutil.which("ip")]
    for program in programs:
        shutil.copy(program, folder / "bin")
        for library in libraries(program):
            target = folder / ("lib64" if library.startswith("/lib64") else "lib") / pathlib.Path(library).name
            if not target.exists():
                shutil.copy(library, target)
    shutil.copy(shutil.which("busybox"), folder / "bin/busybox")
    applets = "sh mount insmod sleep grep seq kill cp tar dd sync poweroff mkdir cat ls"
    for applet in applets.split():
        (folder / "bin" / applet).symlink_to("busybox")
    modules = MODULES + DRIVERS[bus]
    for module in modules:
        shutil.copy(next(root.glob(f"lib/modules/*/kernel/**/{module}.ko")), folder / "modules")
    (folder / "work/vm.toml").write_text(vm_config(source))
    (folder / "work/part.ngc").write_text(PROGRAM)
    shutil.copy(source / "examples/tools.tbl", folder / "work")
    shutil.copy(source / "configs/eds/servo.eds", folder / "work/eds")
    setup, drives_on = BUS[bus]
    init = folder / "init"
    init.write_text(INIT.format(modules=" ".join(modules), bus=setup, drives_on=drives_on))
    init.chmod(0o755)
    archive = folder.with_suffix(".cpio")
    subprocess.run(f"find . | cpio -o -H newc --quiet > '{archive}'", shell=True, cwd=folder, check=True)
    return archive


def boot(work, root, archive):
    disk = work / "out.tar"
    with open(disk, "wb") as file:
        file.truncate(256 << 20)
    command = ["qemu-system-x86_64", "-accel", "tcg,thread=multi", "-cpu", "max", "-smp", "2", "-m", "1024",
               "-display", "none", "-monitor", "none", "-serial", f"file:{work / 'console.log'}", "-no-reboot",
               "-nic", "none", "-kernel", str(next(root.glob("boot/vmlinuz-*"))), "-initrd", str(archive),
               "-append", "console=ttyS0 quiet panic=-1 rdinit=/init",
               "-drive", f"file={disk},format=raw,if=virtio",
               "-object", "can-bus,id=cb0", "-device", "kvaser_pci,canbus=cb0", "-device", "kvaser_pci,canbus=cb0"]
    subprocess.run(command, timeout=1500, check=True)
    with tarfile.open(disk, ignore_zeros=False) as tar:
        tar.extractall(work)


def read_bus(path):
    """(time s, id, bytes) of every frame of a candump log."""
    frames = []
    for line in path.read_text().splitlines():
        match = re.match(r"\(([\d.]+)\) \S+ ([0-9A-F]+)#([0-9A-F]*)$", line)
        if match:
            frames.append((float(match[1]), int(match[2], 16), bytes.fromhex(match[3])))
    return frames


def changing(rows):
    """Each row that differs from the one before."""
    out = []
    for row in rows:
        if not out or out[-1] != row:
            out.append(row)
    return out


def targets_on_bus(frames):
    """Target positions of the five drives, one row a SYNC, while all are commanded 'enable operation' in mode 8."""
    rows, now = [], {}
    for _, can_id, data in frames:
        if can_id == 0x80:
            enabled = len(now) == 5 and all(v[0] & 0x1F == 0x0F and v[2] == 8 for v in now.values())
            if enabled:
                rows.append(tuple(now[n][1] for n in range(1, 6)))
        elif 0x201 <= can_id <= 0x205 and len(data) == 7:
            now[can_id - 0x200] = (int.from_bytes(data[0:2], "little"),
                                   int.from_bytes(data[2:6], "little", signed=True), data[6])
    return rows


def targets_of_trace(path):
    """The trace's setpoints in counts: 10000 a mm, 10000 a degree from the program's first dwell on."""
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    table = list(csv.DictReader(lines))
    out = []
    for row in table:
        if int(row["line"]) < FIRST_LINE:
            continue
        q = [float(row[name]) for name in ("X", "Y", "Z", "A", "C")]
        scale = [10000] * 3 + [10000 / (math.pi / 180)] * 2
        out.append(tuple(round(a * b) for a, b in zip(q, scale)))
    return out



def judge_setpoints(work, build, frames):
    run = work / "run.csv"
    subprocess.run([build / "trunnion", "run", work / "initramfs/work/part.ngc", "--machine",
                    work / "initramfs/work/vm.toml", "--tools", work / "initramfs/work/tools.tbl", "--trace", run],
                   check=True, capture_output=True)
    wanted = changing(targets_of_trace(run))
    seen = changing(targets_on_bus(frames))
    start = next((i for i in range(len(seen)) if seen[i:i + 3] == wanted[:3]), None)
    same = start is not None and seen[start:start + len(wanted)] == wanted
    first = next((i for i, (a, b) in enumerate(zip(seen[start or 0:], wanted)) if a != b), None)
    print(f"  setpoints: {len(wanted)} rows of `run`, {len(seen)} on the bus, the same: {same}"
          + ("" if same else f" (from row {start}, first difference at {first})"))
    return same


def judge_frames(work, frames):
    log = work / "bus.log"
    out = subprocess.run(["tshark", "-r", log, "-d", "can.subdissector,canopen", "-T", "fields", "-e",
                          "frame.protocols", "-e", "_ws.malformed"], capture_output=True, text=True, check=False)
    lines = out.stdout.splitlines()
    malformed = [line for line in lines if "malformed" in line]
    protocols = collections.Counter(line.split("\t")[0] for line in lines)
    print(f"  tshark: {len(lines)} frames, {len(malformed)} malformed, {dict(protocols)}")
    lengths = {can_id: {len(d) for _, i, d in frames if i == can_id} for can_id in range(0x181, 0x186)}
    lengths.update({can_id: {len(d) for _, i, d in frames if i == can_id} for can_id in range(0x201, 0x206)})
    as_mapped = all(sizes == {7} for sizes in lengths.values())
    print(f"  PDOs as mapped (7 bytes each): {as_mapped}")
    return bool(lines) and not malformed and as_mapped


def judge_sync(frames):
    times = [t for t, can_id, _ in frames if can_id == 0x80]
    gaps = sorted(1e6 * (b - a) for a, b in zip(times, times[1:]))
    late = [abs(gap - 1e6 * PERIOD_S) for gap in gaps]
    late.sort()
    rank = {share: late[min(len(late) - 1, int(share * len(late)))] for share in (0.5, 0.9, 0.99)}
    print(f"  SYNC: {len(times)}, mean period {statistics.mean(gaps):.1f} us, jitter p50 {rank[0.5]:.0f} "
          f"p90 {rank[0.9]:.0f} p99 {rank[0.99]:.0f} max {late[-1]:.0f} us (emulated processor, shared host)")


def judge(work, build):
    client = (work / "client.log").read_text()
    print("  " + client.strip().replace("\n", "\n  ")[-1500:])
    frames = read_bus(work / "bus.log")
    good = client.count("exit 0") == 4 and "daemon exit 0" in client
    good &= judge_frames(work, frames)
    judge_sync(frames)
    good &= judge_setpoints(work, build, frames)
    return good


def main():
    build, source = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
    for tool in ("qemu-system-x86_64", "cpio", "busybox", "candump", "tshark", "ip"):
        if not shutil.which(tool):
            skip(f"{tool} is not here")
    cache = build / "can-vm"
    root = kernel_folder(cache)
    good = True
    for bus in sys.argv[3:] or ["vcan", "kvaser"]:
        print(f"{bus}:", flush=True)
        work = cache / bus
        work.mkdir(exist_ok=True)
        boot(work, root, build_initramfs(work / "initramfs", build, source, root, bus))
        good &= judge(work, build)
    print("passed" if good else "FAILED")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
