"""The same tests on a host whose own kernel has virtual CAN: in a network of their own, without a virtual machine.

What runs there is not real time, and the clock is the host's: what is judged is what was said, not when.
"""
import contextlib
import os
import shutil
import signal
import socket
import subprocess
import tempfile

OWN_NETWORK = ["unshare", "-rn"]
SETUP = ("ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo; "
         "exec sh script > console.log 2>&1")


def has_virtual_can():
    """Sockets, interfaces, and the right to make them."""
    try:
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW):
            pass
    except OSError:
        return False
    make = OWN_NETWORK + ["ip", "link", "add", "dev", "vcan0", "type", "vcan"]
    tools = all(shutil.which(tool) for tool in ("unshare", "ip", "candump", "cansend"))
    return tools and subprocess.run(make, capture_output=True, check=False).returncode == 0


def run(work, build, files, script, timeout_s=5400):
    """`files`, `script`: as in guest.make_initramfs; what it leaves in *.log is then in `work`."""
    place = work / "fs/work"
    shutil.rmtree(work / "fs", ignore_errors=True)
    for name, content in {**files, "script": script}.items():
        target = place / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, str):
            target.write_text(content)
        else:
            shutil.copy(content, target)
    with tempfile.TemporaryDirectory() as runtime:
        environment = dict(os.environ, PATH=f"{build}:{os.environ['PATH']}", XDG_RUNTIME_DIR=runtime)
        with subprocess.Popen([*OWN_NETWORK, "sh", "-c", SETUP], cwd=place, env=environment,
                              start_new_session=True) as session:
            try:
                session.wait(timeout_s)
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(session.pid, signal.SIGKILL)  # candump and the drives go on by themselves
    for log in place.glob("*.log"):
        shutil.move(log, work / log.name)
