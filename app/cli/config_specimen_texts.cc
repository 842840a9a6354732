#include "app/cli/config_specimen_texts.h"

namespace trn {

namespace {

constexpr char kFiveJoints[] = R"(
[machine]
name = "specimen"
period_s = 0.02
[[joint]]
name = "@X"
type = "linear"
min_mm = -@range
max_mm = @range
velocity_mm_s = 500.0
acceleration_mm_s2 = 5000.0
jerk_mm_s3 = 100000.0
[[joint]]
name = "@Y"
type = "linear"
min_mm = -@range
max_mm = @range
velocity_mm_s = 500.0
acceleration_mm_s2 = 5000.0
jerk_mm_s3 = 100000.0
[[joint]]
name = "@Z"
type = "linear"
min_mm = @low
max_mm = @range
velocity_mm_s = 400.0
acceleration_mm_s2 = 4000.0
jerk_mm_s3 = 80000.0
[[joint]]
name = "@A"
type = "rotary"
min_deg = -120.0
max_deg = 120.0
velocity_deg_s = 120.0
acceleration_deg_s2 = 800.0
jerk_deg_s3 = 16000.0
[[joint]]
name = "@C"
type = "rotary"
min_deg = @low
max_deg = 3600.0
velocity_deg_s = 240.0
acceleration_deg_s2 = 1500.0
jerk_deg_s3 = 30000.0
[kinematics]
type = "serial"
[[kinematics.tool_branch]]
joint = "@X"
word = "X"
direction = [1, 0, 0]
[[kinematics.tool_branch]]
joint = "@Y"
word = "Y"
direction = [0, 1, 0]
[[kinematics.tool_branch]]
joint = "@Z"
word = "Z"
direction = [0, 0, 1]
[[kinematics.tool_branch]]
offset_mm = [0, 0, 0]
direction = [1, 0, 0]
tilt_deg = 0
[[kinematics.work_branch]]
joint = "@A"
word = "A"
direction = [1, 0, 0]
[[kinematics.work_branch]]
joint = "@C"
word = "C"
direction = [0, 0, 1]
[[kinematics.work_branch]]
offset_mm = [0, 0, 0]
)";

constexpr char kProgram[] = R"(
[program]
safe_z_mm = 100
end_required = true
[[program.m_code]]
code = "M111"
call = "touch"
[[program.m_code]]
code = "M112"
output = 5
[planner]
[realtime]
late_periods_max = 5
[lcm]
[scope]
[access]
socket = "/run/trunnion/mill.sock"
operate = "operators"
set_up = "setters"
[gateway]
[[gateway.key]]
name = "desk"
public = "11qYAYKxCrfVS/7TyWQHOg7hcvPapiMlrwIaaPcHURo="
role = "operate"
)";

// What axes lie beside their places, below @errors.
constexpr char kAxisErrors[] = R"(
[[@errors.axis]]
joint = "@X"
[@errors.axis.table]
at_mm = [-400, 0, 400, 600]
ex_mm = [0, 0, 0, 0]
ey_mm = [0, 0, 0, 0]
ez_mm = [0, 0, 0, 0]
ea_arcsec = [0, 0, 0, 0]
eb_arcsec = [0, 0, 0, 0]
ec_arcsec = [0, 0, 0, 0]
[[@errors.axis]]
joint = "@C"
[@errors.axis.table]
periodic = true
at_deg = [0, 90, 180, 270, 360]
ex_mm = [0, 0, 0, 0, 0]
ey_mm = [0, 0, 0, 0, 0]
ez_mm = [0, 0, 0, 0, 0]
ea_arcsec = [0, 0, 0, 0, 0]
eb_arcsec = [0, 0, 0, 0, 0]
ec_arcsec = [0, 0, 0, 0, 0]
)";

constexpr char kCorrections[] = R"(
[corrections.geometric]
m_on = "M401"
m_off = "M402"
[corrections.joint_table]
m_on = "M411"
m_off = "M412"
[[corrections.joint_table.joint]]
joint = "@X"
at_mm = [-400, 0, 400, 600]
forward_mm = [0, 0, 0, 0]
backward_mm = [0, 0, 0, 0]
[[corrections.joint_table.joint]]
joint = "@C"
at_deg = [0, 90, 180, 270, 360]
forward_deg = [0, 0, 0, 0, 0]
backward_deg = [0, 0, 0, 0, 0]
[corrections.screw]
m_on = "M421"
m_off = "M422"
[[corrections.screw.axis]]
joint = "@X"
mounting = "fixed-preload"
stretch_mm = 0.03
fixed_bearing_mm = -@bearing
far_bearing_mm = @bearing
sensor = "warm"
min_C = -@k
[[corrections.screw.axis]]
joint = "@Y"
mounting = "fixed-free"
fixed_bearing_mm = -@bearing
far_bearing_mm = @bearing
[corrections.deflection]
m_on = "M431"
m_off = "M432"
stiffness_N_mm = [50, 50]
[corrections.deflection.X]
gain_mm_s2_A = 2010
damping_1_s = 3.89
mass_kg = 2
sigma_current_A = 0.016
sigma_load_rate_N_s = 130
sigma_position_mm = 0.0002
[corrections.deflection.Y]
gain_mm_s2_A = 689
damping_1_s = 10.2
mass_kg = 6
sigma_current_A = 0.009
sigma_load_rate_N_s = 93
sigma_position_mm = 0.0002
)";

// The keys of simulated drives and inputs, below @drives and @io.
constexpr char kSimulatedDrives[] = R"(
natural_frequency_hz = 3@k
damping = 0.@k
velocity_feed_forward = 0.@k
quick_stop_factor = 1.@k
homed = @bool
following_error_mm = @k
following_error_deg = @k
homing_speed_mm_s = @k
homing_speed_deg_s = @k
index_speed_mm_s = @k
index_speed_deg_s = @k
index_distance_mm = @k
index_distance_deg = @k
limit_switch_margin_mm = @k
limit_switch_margin_deg = @k
[[@drives.joint]]
name = "@X"
[@drives.joint.mechanism]
inertia_kg = 100
cogging_pitch_mm = 24
cogging_N = [1]
cogging_at_mm = [0]
[[@drives.joint]]
name = "@Z"
[[@drives.joint]]
name = "@A"
[@drives.joint.mechanism]
inertia_kg_m2 = 1
cogging_pitch_deg = 24
cogging_Nm = [1]
cogging_at_deg = [0]
[[@drives.joint]]
name = "@C"
[[@drives.script]]
at_s = 1
joint = "@X"
event = "fault"
)";
constexpr char kScrew[] = R"(
[[drives.screw]]
joint = "@X"
mounting = "fixed-preload"
stretch_mm = 0.03
fixed_bearing_mm = -@bearing
far_bearing_mm = @bearing
sensor = "warm"
[[drives.screw]]
joint = "@Y"
mounting = "fixed-free"
fixed_bearing_mm = -@bearing
far_bearing_mm = @bearing
)";
constexpr char kShapes[] = R"(
[[@io.plate]]
min_mm = [-40, -40, -60]
max_mm = [40, 40, -20]
[[@io.plate.bore]]
x_mm = 0
y_mm = 0
diameter_mm = @k
depth_mm = 4
[[@io.boss]]
diameter_mm = @k
height_mm = @k
[[@io.ball]]
at_mm = [0, 0, @k]
diameter_mm = @k
)";
constexpr char kSimulatedIo[] = R"(
[@io.spindle]
[[@io.wire]]
output = 0
input = 0
[[@io.wire]]
analog_output = 0
analog_input = 0
[[@io.script]]
at_s = 1
input = 1
value = 1
[[@io.script]]
at_s = 1
analog_input = 1
value = 1
)";

constexpr char kCan[] = R"(
[drives]
type = "canopen"
probe = "drive"
heartbeat_ms = @k00
[[drives.bus]]
interface = "can0"
[[drives.node]]
joint = "@X"
id = 1
eds = "@sheet"
counts_per_mm = 1000
@bus
interpolation_period = [20, -3]
home_final_mm = @k
following_error_mm = @k
following_error_ms = @k0
at_shutdown = "ramp"
at_disable = "ramp"
at_halt = "ramp"
[drives.node.habits]
mode_display = @bool
pdo_order = ["off", "clear", "map", "count", "type", "on"]
[[drives.node.write]]
index = 0x2110
value = 1
[[drives.node]]
joint = "@Y"
id = 2
eds = "@sheet"
counts_per_mm = 1000
@bus
[[drives.node]]
joint = "@Z"
id = 3
eds = "@sheet"
counts_per_mm = 1000
@bus
[[drives.node]]
joint = "@A"
id = 4
eds = "@sheet"
counts_per_deg = 1000
home_final_deg = @k
@bus
[[drives.node]]
joint = "@Y"
id = 6
eds = "@sheet"
counts_per_mm = 1000
square_mm = 0.1
@bus
[[drives.node]]
joint = "@A"
id = 7
eds = "@sheet"
counts_per_deg = 1000
home_final_deg = @k
@bus
[[drives.gantry]]
joint = "@Y"
apart_mm = @k
[[drives.gantry]]
joint = "@A"
apart_deg = @k
[[drives.node]]
joint = "@C"
id = 5
eds = "@sheet"
counts_per_deg = 1000
home_final_deg = 2@k
@bus
[drives.emulation]
)";

constexpr char kSlowDrives[] = R"(
[drives]
type = "modbus"
[[drives.line]]
name = "drives @k"
address = "tcp:127.0.0.1:1502"
[[drives.axis]]
joint = "@X"
line = "drives @k"
unit = 1
turnaround_ms = 0.5
command = 100
answer = 200
counts_per_mm = 100
[[drives.axis]]
joint = "@Y"
line = "drives @k"
unit = 2
turnaround_ms = 0.5
command = 100
answer = 200
counts_per_mm = 100
[[drives.axis]]
joint = "@Z"
line = "drives @k"
unit = 3
turnaround_ms = 0.5
command = 100
answer = 200
counts_per_mm = 100
[[drives.axis]]
joint = "@A"
line = "drives @k"
unit = 4
turnaround_ms = 0.5
command = 100
answer = 200
counts_per_deg = 100
[[drives.axis]]
joint = "@C"
line = "drives @k"
unit = 5
turnaround_ms = 0.5
command = 100
answer = 200
counts_per_deg = 100
[drives.emulation]
)";

constexpr char kModbusIo[] = R"(
[[modbus.line]]
name = "cabinet @k"
address = "tcp:127.0.0.1:1503"
[[modbus.device]]
name = "@device"
line = "cabinet @k"
poll_s = 0.@k
[[modbus.device.value]]
name = "coil"
table = "coil"
address = 0
[[modbus.device.value]]
name = "speed"
table = "holding"
address = 1
[[modbus.emulation]]
value = "@device.coil"
[io]
type = "modbus"
mist = "@device.coil"
flood = "@device.coil"
[io.spindle]
speed = "@device.speed"
run = "@device.coil"
reverse = "@device.coil"
actual = "@device.speed"
at_speed = "@device.coil"
fault = "@device.speed"
)";

constexpr char kThreeJoints[] = R"(
[machine]
name = "specimen"
period_s = 0.001
[[joint]]
name = "X"
type = "linear"
min_mm = -30
max_mm = 30
velocity_mm_s = 200
acceleration_mm_s2 = 10000
jerk_mm_s3 = 1000000
[[joint]]
name = "Y"
type = "linear"
min_mm = -30
max_mm = 30
velocity_mm_s = 200
acceleration_mm_s2 = 8000
jerk_mm_s3 = 800000
[[joint]]
name = "Z"
type = "linear"
min_mm = -25
max_mm = 25
velocity_mm_s = 50
acceleration_mm_s2 = 1000
jerk_mm_s3 = 50000
[kinematics]
type = "serial"
[[kinematics.tool_branch]]
joint = "Z"
direction = [0, 0, 1]
[[kinematics.work_branch]]
joint = "Y"
direction = [0, -1, 0]
[[kinematics.work_branch]]
joint = "X"
direction = [-1, 0, 0]
[drives]
type = "micro_mill"
)";

/// The head of a parallel machine with `count` legs or rails of the same range.
std::string sliders(int count, const std::string& min_mm, const std::string& max_mm) {
  std::string text = "[machine]\nname = \"specimen\"\nperiod_s = 0.001\n";
  for (int i = 0; i < count; ++i)
    text += "[[joint]]\nname = \"slider" + std::to_string(i) + "\"\ntype = \"linear\"\nmin_mm = " + min_mm +
            "\nmax_mm = " + max_mm +
            "\nvelocity_mm_s = 300\nacceleration_mm_s2 = 4000\njerk_mm_s3 = 100000\n";
  return text + "[drives]\ntype = \"loopback\"\n";
}

constexpr char kHexapod[] = R"(
[kinematics]
type = "hexapod"
carries = "work"
spindle_mm = [0, 0, 700]
home_mm = [0, 0, 640]
joint_angle_deg_max = 45
[[kinematics.leg]]
base_mm = [309, -82.8, 0]
platform_mm = [141.4, -141.4, 0]
[[kinematics.leg]]
base_mm = [309, 82.8, 0]
platform_mm = [141.4, 141.4, 0]
[[kinematics.leg]]
base_mm = [-82.8, 309, 0]
platform_mm = [51.8, 193.2, 0]
[[kinematics.leg]]
base_mm = [-226.3, 226.3, 0]
platform_mm = [-193.2, 51.8, 0]
[[kinematics.leg]]
base_mm = [-226.3, -226.3, 0]
platform_mm = [-193.2, -51.8, 0]
[[kinematics.leg]]
base_mm = [-82.8, -309, 0]
platform_mm = [51.8, -193.2, 0]
)";

constexpr char kRailMill[] = R"(
[kinematics]
type = "rail_mill"
carries = "spindle"
spindle_mm = [0, 0, 0]
home_mm = [0, 0, -300]
[[kinematics.rail]]
rail_mm = [0, 400, 50]
direction = [1, 0, 0]
platform_mm = [0, 100, 40]
link_mm = 600
sign = 1
[[kinematics.rail]]
rail_mm = [0, 400, -50]
direction = [1, 0, 0]
platform_mm = [0, 100, -40]
link_mm = 600
sign = -1
[[kinematics.rail]]
rail_mm = [0, -400, 50]
direction = [1, 0, 0]
platform_mm = [0, -100, 40]
link_mm = 600
sign = 1
[[kinematics.rail]]
rail_mm = [0, -400, -50]
direction = [1, 0, 0]
platform_mm = [0, -100, -40]
link_mm = 600
sign = -1
)";

std::string below(std::string text, const std::string& blank, const std::string& table) {
  for (std::size_t at = 0; (at = text.find(blank, at)) != std::string::npos; at += table.size())
    text.replace(at, blank.size(), table);
  return text;
}

std::string screws(const char* first, const char* second) {
  return below(below(kScrew, "@X", first), "@Y", second);
}
std::string drives_below(const char* table) { return below(kSimulatedDrives, "@drives", table); }
std::string errors_below(const std::string& table) { return below(kAxisErrors, "@errors", table); }
std::string shapes_below(const std::string& table) {
  return below(kShapes, "@io", table) + errors_below(table + ".errors");
}
std::string io_below(const char* table) {
  return below(kSimulatedIo, "@io", table) + "[" + table + ".probe]\nlength_mm = 40\n" + shapes_below(table);
}

}  // namespace

std::vector<ConfigSpecimen> machine_specimens() {
  const std::string five = std::string(kFiveJoints) + kProgram, can = kCan;
  const std::string told = five + kTorqueSpecimen;  // in advance, which drives on Modbus are not
  const std::string shapes = "[drives.emulation.probe]\n" + shapes_below("drives.emulation");
  return {
      {"simulated",
       told + kCorrections + errors_below("corrections.geometric") +
           "[tool_change]\nconfirm = \"input\"\ninput = 3\n[tangential]\n[drives]\ntype = \"simulated\"" +
           drives_below("drives") + kScrew + "[io]\ntype = \"simulated\"\n" + io_below("io"),
       ""},
      {"canopen on one bus",
       told + below(can, "@bus", "") + drives_below("drives.emulation") + kMotorSpecimen + kSafetySpecimen +
           shapes + kScrew + "[tool_change]\nconfirm = \"sub-program\"\ncall = \"change\"\n",
       ""},
      {"canopen on two buses",
       told + below(can, "@bus", "bus = \"can@k\"") + drives_below("drives.emulation") + shapes +
           "[tool_change]\nconfirm = \"none\"\n[[drives.bus]]\ninterface = \"can1\"\n",
       "[[drives.bus]]\ninterface = \"can2\"\n"},
      {"modbus",
       five + kSlowDrives + drives_below("drives.emulation") + kScrew + kModbusIo + io_below("io.emulation"),
       ""},
      {"modbus on two lines",
       five + kSlowDrives + drives_below("drives.emulation") + kModbusIo + io_below("io.emulation") +
           "[[drives.line]]\nname = \"other\"\naddress = \"tcp:127.0.0.1:1504\"\n"
           "[[modbus.line]]\nname = \"other\"\naddress = \"tcp:127.0.0.1:1505\"\n",
       ""},
      {"micro-mill", kThreeJoints + screws("X", "Y"), ""},
      {"hexapod", sliders(6, "480", "920") + kHexapod + screws("slider0", "slider1"), ""},
      {"rail mill", sliders(4, "-1200", "1200") + kRailMill + screws("slider0", "slider1"), ""},
  };
}

}  // namespace trn
