"""Whole machines that have the tables which no shipped config has. A host is a shipped config, with what is added."""
import re

# One table of errors, of a linear and of a rotary joint, below any of the tables that have errors.
ERRORS = """
[[@.axis]]
joint = "X"
ex0_mm = 0.01
ey0_mm = 0.01
ez0_mm = 0.01
ea0_arcsec = 3
eb0_arcsec = 3
ec0_arcsec = 3
[@.axis.table]
at_mm = [-400, 0, 400]
ex_mm = [0, 0.01, 0]
ey_mm = [0, 0.01, 0]
ez_mm = [0, 0.01, 0]
ea_arcsec = [0, 1, 0]
eb_arcsec = [0, 1, 0]
ec_arcsec = [0, 1, 0]
[[@.axis]]
joint = "C"
[@.axis.table]
periodic = true
at_deg = [0, 120, 240, 360]
ex_mm = [0, 0.01, 0, 0]
ea_arcsec = [0, 1, 0, 0]
"""
MECHANISMS = """
[[@.joint]]
name = "X"
start_mm = 0.0
[@.joint.mechanism]
inertia_kg = 100
force_max_N = 4000
cogging_pitch_mm = 24
cogging_N = [1]
cogging_at_mm = [0]
[[@.joint]]
name = "A"
start_deg = 0.0
[@.joint.mechanism]
inertia_kg_m2 = 1
force_max_Nm = 400
cogging_pitch_deg = 24
cogging_Nm = [1]
cogging_at_deg = [0]
"""
HAPPENS = """
[[@.script]]
at_s = 1000
joint = "X"
event = "fault"
"""
SCREW = """
[[drives.screw]]
joint = "@"
mounting = "fixed-preload"
stretch_mm = 0.03
fixed_bearing_mm = -1300
far_bearing_mm = 1300
sensor = "warm"
"""
SHAPES = """
[@.probe]
length_mm = 40
[[@.plate]]
min_mm = [-40, -40, -60]
max_mm = [40, 40, -20]
[[@.plate.bore]]
x_mm = 0
y_mm = 0
diameter_mm = 20
depth_mm = 4
[[@.boss]]
diameter_mm = 20
height_mm = 10
[[@.ball]]
at_mm = [0, 0, 100]
diameter_mm = 20
"""
TOUCHED = """
[@.spindle]
lag_s = 0.1
[[@.script]]
at_s = 1000
input = 1
value = 1
[[@.script]]
at_s = 1000
analog_input = 1
value = 1
"""
CODES = """
[[program.m_code]]
code = "M111"
output = 5
[[program.m_code]]
code = "M112"
call = "touch"
[tool_change]
confirm = "input"
input = 3
"""
HOST = """
[realtime]
late_periods_max = 5
[scope]
seconds = 10
[lcm]
url = "udpm://239.255.76.67:7667?ttl=0"
[access]
socket = "/run/trunnion/mill.sock"
operate = "operators"
set_up = "setters"
[gateway]
rate_hz_max = 50
[[gateway.key]]
name = "desk"
public = "11qYAYKxCrfVS/7TyWQHOg7hcvPapiMlrwIaaPcHURo="
role = "operate"
"""
MODBUS_DRIVES = """
[drives]
type = "modbus"
[[drives.line]]
name = "drives"
address = "tcp:127.0.0.1:1502"
""" + "".join(f"""
[[drives.axis]]
joint = "{joint}"
line = "drives"
unit = {unit}
turnaround_ms = 0.5
command = 100
answer = 200
counts_per_{length} = 100
""" for unit, (joint, length) in enumerate(zip("XYZAC", ["mm", "mm", "mm", "deg", "deg"]), 1)) + """
[drives.emulation]
homed = true
"""
CABINET = """
[[modbus.line]]
name = "cabinet"
address = "tcp:127.0.0.1:1503"
[[modbus.device]]
name = "box"
line = "cabinet"
[[modbus.device.value]]
name = "coil"
table = "coil"
address = 0
[[modbus.device.value]]
name = "speed"
table = "holding"
address = 1
[io]
type = "modbus"
mist = "box.coil"
[io.spindle]
speed = "box.speed"
run = "box.coil"
[io.emulation]
"""


def below(text, table):
    return text.replace("@", table)


def without_drives(text):
    """A config up to its drives, which stand last in it."""
    return text[:re.search(r"^\[drives\]", text, re.M).start()]


def hosts(source):
    """(name of the file, text) of each. Names lie in configs/, whose files they name."""
    def shipped(name):
        return (source / f"configs/{name}.toml").read_text()

    cradle = without_drives(shipped("cradle"))
    slow = re.sub(r"(period_s) = .*", r"\1 = 0.02", cradle)
    yield "host_simulated.toml", (
        cradle + CODES + HOST + "[corrections.geometric]\n" + below(ERRORS, "corrections.geometric") +
        "[drives]\ntype = \"simulated\"\n" + below(MECHANISMS + HAPPENS, "drives") + below(SCREW, "X") +
        "[io]\ntype = \"simulated\"\n" + below(TOUCHED + SHAPES, "io") + below(ERRORS, "io.errors"))
    yield "host_sub_program.toml", cradle + ("[tool_change]\nconfirm = \"sub-program\"\ncall = \"change\"\n[drives]\n"
                                             "type = \"loopback\"\n" + below(SCREW, "X"))
    yield "host_can.toml", (
        shipped("cradle_can") + "[drives.node.habits]\nmode_display = true\n[[drives.node.write]]\nindex = 0x6099\n"
        "sub = 1\nvalue = 10000\n[drives.emulation]\n" + below(MECHANISMS + HAPPENS, "drives.emulation") +
        below(SHAPES, "drives.emulation").replace("length_mm = 40", "tip_diameter_mm = 4") +
        below(ERRORS, "drives.emulation.errors") + below(SCREW, "X"))
    yield "host_modbus.toml", (
        slow + MODBUS_DRIVES + below(MECHANISMS + HAPPENS, "drives.emulation") + below(SCREW, "X") + CABINET +
        below(TOUCHED + SHAPES, "io.emulation") + below(ERRORS, "io.emulation.errors"))
    yield "host_stage.toml", shipped("micro_stage") + below(SCREW, "X")
    yield "host_drawn.toml", (
        cradle + "[[drawing]]\npart = \"Y\"\nstl = \"drawn.stl\"\n[drives]\ntype = \"simulated\"\n")


# A part that can be drawn: a body of four triangles.
STL = "solid t\n" + "".join(
    "facet normal 0 0 1\nouter loop\n" + "".join(f"vertex {' '.join(map(str, v))}\n" for v in corners) +
    "endloop\nendfacet\n"
    for corners in ([(0, 0, 0), (0, 9, 0), (9, 0, 0)], [(0, 0, 0), (9, 0, 0), (0, 0, 9)],
                    [(0, 0, 0), (0, 0, 9), (0, 9, 0)], [(9, 0, 0), (0, 9, 0), (0, 0, 9)])) + "endsolid t\n"

FAULTS = ("cradle_can", """
[[fault]]
at_s = 1
bus = 0
node = 1
kind = "silent"
"""), ("mill_modbus", """
[[fault]]
at_s = 1
device = "inverter"
kind = "silent"
""")
