#include "app/cli/config_meanings.h"

namespace trn {

const ChapterMeaning kDriveMeanings = {
    "Drives",
    "[drives.md](drives.md) has examples and figures.",
    {
        {"Kind of drives",
         {{"drives", "*"}},
         "",
         {{"type",
           "`canopen` and `modbus` are real drives in `trunnion daemon`; in `trunnion run` the first are "
           "emulated frame for frame, and simulated drives stand for the others. `simulated` drives have a"
           " servo loop, switches and faults. `loopback` answers with its setpoint and has no keys of its "
           "own. `micro_mill` is the simulated stage of [micromill.md](micromill.md)."}}},
        {"Simulated drives",
         {{"drives", "simulated"}, {"drives.emulation", "canopen"}, {"drives.emulation", "modbus"}},
         "In `[drives.emulation]` they describe what stands for real drives in `trunnion run` and in "
         "`trunnion-drives`. The keys in mm are "
         "those of "
         "linear joints, the ones in degrees those of rotary joints.",
         {
             {"natural_frequency_hz", "Natural frequency of the position loop: higher is stiffer."},
             {"damping", "Damping of the loop; 1 is critical."},
             {"velocity_feed_forward", "1: no lag at constant speed; 0: the full following error."},
             {"following_error_mm following_error_deg",
              "Distance between setpoint and measurement that is the fault `following_error`."},
             {"quick_stop_factor", "A quick stop brakes with so many times the joint's acceleration limit."},
             {"homed",
              "Whether the encoder knows its position at power-on, so that nothing needs homing. Drives "
              "emulated on a bus go by their `absolute` instead."},
             {"homing_speed_mm_s homing_speed_deg_s", "Speed of the search for the home switch."},
             {"index_speed_mm_s index_speed_deg_s", "Speed from the switch to the encoder's index."},
             {"index_distance_mm index_distance_deg", "How far above the edge of the switch the index lies."},
             {"limit_switch_margin_mm limit_switch_margin_deg",
              "How far beyond the joint's range the limit switches are."},
             {"start_up_s",
              "Time from power to enabled. Drives emulated on a bus take the time of their own bring-up."},
             {"homing_timeout_s", "Homing that takes longer is a fault."},
         }},
        {"One simulated joint",
         {{"drives.joint", "simulated"},
          {"drives.emulation.joint", "canopen"},
          {"drives.emulation.joint", "modbus"}},
         "What differs from the section above for this joint.",
         {
             {"name", "The joint.", "", "the name of a joint"},
             {"start_mm start_deg", "Where the joint stands at power-on.",
              "0, or the end of its range nearest to it", "within the joint's range"},
             {"home_mm home_deg",
              "The home switch is closed below this position. Drives emulated on CAN go by the `home` of "
              "their node.",
              "0, or the end of its range nearest to it", "within the joint's range"},
             {"natural_frequency_hz", "As above.", "that of the section"},
             {"damping", "As above.", "that of the section"},
             {"velocity_feed_forward", "As above.", "that of the section"},
             {"following_error_mm following_error_deg", "As above.", "that of the section"},
             {"quick_stop_factor", "As above.", "that of the section"},
             {"homed", "As above.", "that of the section"},
             {"homing_speed_mm_s homing_speed_deg_s", "As above.", "that of the section"},
             {"index_speed_mm_s index_speed_deg_s", "As above.", "that of the section"},
             {"index_distance_mm index_distance_deg", "As above.", "that of the section"},
             {"limit_switch_margin_mm limit_switch_margin_deg", "As above.", "that of the section"},
         }},
        {"A mechanism",
         {{"drives.joint.mechanism", "simulated"},
          {"drives.emulation.joint.mechanism", "canopen"},
          {"drives.emulation.joint.mechanism", "modbus"}},
         "In place of the plain servo loop: a drive with P on the position and PI on the velocity. Its joint "
         "has "
         "mass, friction and weight. `trunnion following` and `trunnion tune` are rehearsed on it.",
         {
             {"position_gain_1_s", "Gain of the drive's position loop."},
             {"velocity_loop_hz", "Bandwidth of the drive's velocity loop."},
             {"integral_time_s", "Of the velocity loop; 0: it has no integral part."},
             {"force_max_N force_max_Nm", "What the motor can make; 0: anything."},
             {"inertia_kg inertia_kg_m2", "Mass, or moment of inertia, that the motor moves, with its own."},
             {"viscous_N_s_mm viscous_Nm_s", "Friction that grows with the speed."},
             {"coulomb_N coulomb_Nm", "Friction that does not."},
             {"gravity_N gravity_Nm", "What holds the joint against its weight."},
             {"imbalance_Nm", "What holds a rotary joint against its weight where that is greatest."},
             {"imbalance_at_deg", "Where that is."},
             {"cogging_pitch_mm cogging_pitch_deg", "The way after which the motor's cogging repeats.",
              "required with `cogging_N`"},
             {"cogging_N cogging_Nm", "Its waves: of one in a pitch, of two, and so on.", "no cogging",
              "1 to 4 numbers"},
             {"cogging_at_mm cogging_at_deg", "Where each wave is greatest.", "at 0", "as many numbers"},
             {"resonance_hz",
              "Frequency at which motor and load swing against each other; 0: they are rigid."},
             {"resonance_damping", "Damping of it; 1 is critical."},
             {"load_share", "Share of the inertia that is the load's."},
             {"backlash_mm backlash_deg", "Play between motor and load, with a `resonance_hz` only."},
         }},
        {"One emulated motor",
         {{"drives.emulation.motor", "canopen"}},
         "What is true of this motor and not of its joint. A gantry hangs askew, a switch is not where it "
         "should be, or an axis falls.",
         {
             {"node", "The drive.", "", "bus and node id, as \"can0:3\""},
             {"start_offset_mm start_offset_deg", "How far from its joint's start it stands at power-on."},
             {"inputs_on", "Bits of its 0x60FD that are on.", "none", "numbers, 0 to 31"},
             {"serial", "Its serial number, for `trunnion can lss`; 0: by the data sheet."},
             {"without_id", "Whether nobody has given it its node id yet: it waits for `trunnion can lss`."},
             {"stores",
              "Whether it keeps what it is told to store, by LSS and by 0x1010. Else it refuses, as one "
              "whose memory is broken."},
             {"switches_swapped", "Whether each limit switch is wired to the input of the other end."},
             {"falls", "The way in which the axis falls when neither its drive nor its brake holds it."},
             {"brake_release_s", "With `falls`: how long the brake really takes to let go."},
             {"brake_close_s", "And to hold."},
             {"switch_offset_mm switch_offset_deg",
              "How far its home switch really stands beyond the square gantry. The master knows `square_mm` "
              "only."},
         }},
        {"What happens to simulated drives",
         {{"drives.script", "simulated"},
          {"drives.emulation.script", "canopen"},
          {"drives.emulation.script", "modbus"}},
         "For rehearsals: each table is one event. Drives emulated on a bus do not heed it: `trunnion-drives "
         "--faults` has a script for them.",
         {
             {"at_s", "When, counted from the start."},
             {"joint", "To which drive.", "", "the name of a joint"},
             {"event",
              "`fault`: the drive faults and brakes; `lost`: it no longer answers; `found`: it answers "
              "again; `stuck`: "
              "the axis no longer moves; `free`: it moves again."},
         }},
        {"The simulated micro-mill",
         {{"drives", "micro_mill"}},
         "Its joints are exactly X, Y and Z.",
         {
             {"seed",
              "Which stage it is: its friction, ripple, masses and cutter. 0 is the one that the estimator "
              "believes in."},
             {"mass_error", "Share by which the moving masses are heavier still."},
             {"part", "What stands in the plate about the origin and is cut; `none` is no plate."},
             {"following_error_mm",
              "Distance between setpoint and measurement that is the fault `following_error`."},
         }},
    }};

const ChapterMeaning kCanMeanings = {
    "Drives on CANopen",
    "Drives of CiA 402, `type = \"canopen\"`.",
    {
        {"The bus masters",
         {{"drives", "canopen"}},
         "",
         {
             {"master_id", "The master's own node id, of its heartbeat."},
             {"heartbeat_ms", "Time between heartbeats of master and drives; 0: none, see `guarding_ms`."},
             {"heartbeat_timeout_ms",
              "A drive or master that is not heard for so long is lost; longer than "
              "`heartbeat_ms`.",
              "three times `heartbeat_ms`"},
             {"guarding_ms",
              "A drive that cannot send heartbeats, or cannot watch the master's (no 0x1016), is asked by "
              "node "
              "guarding this often; 0: never.",
              "that of `heartbeat_ms`"},
             {"life_time_factor",
              "After so many times `guarding_ms` without an answer the drive counts as lost; the drive stops "
              "by itself when it is not asked for so long."},
             {"missed_max", "Periods without feedback until a drive counts as lost."},
             {"overload_max",
              "Periods in a row in which frames could not be sent until it is the fault "
              "`bus_overload`."},
             {"sync_counter",
              "Overflow of the counter in SYNC, which the drives are told (0x1019); 0: SYNC without "
              "one.",
              "", "not 1"},
             {"sdo_timeout_ms", "How long an answer to a question of the bring-up may take."},
             {"sdo_retries", "How often such a question is asked again."},
             {"boot_timeout_ms", "How long a drive may take to boot."},
             {"enable_timeout_s", "How long a drive may take from power to enabled."},
             {"homing_timeout_s", "How long homing may take."},
             {"probe",
              "`drive`: the touch probe is wired to the drives' own fast inputs, and they take the "
              "positions. The "
              "config needs a section `[io]` then."},
             {"probe_input_bit", "With `probe = \"drive\"`: the bit of 0x60FD that is the probe's level."},
         }},
        {"A bus",
         {{"drives.bus", "canopen"}},
         "",
         {
             {"interface", "The network interface, as \"can0\". Each is there once."},
             {"bitrate", "Bits per second. The daemon does not set it: `ip link` does."},
             {"fd", "Whether setpoints and feedback go in CAN FD frames."},
             {"data_bitrate", "With `fd`: bits per second of the frames' data, not less than `bitrate`."},
         }},
        {"A drive",
         {{"drives.node", "canopen"}},
         "One for each joint, and one for each motor of a gantry.",
         {
             {"joint", "The joint that the drive moves.", "", "the name of a joint"},
             {"bus", "The `interface` of its bus.", "the only bus; required with several", "an interface"},
             {"id", "The drive's node id; not the master's."},
             {"eds",
              "The drive's data sheet, a file beside the config: an EDS, or a DCF whose ParameterValues are "
              "written at every bring-up."},
             {"mode",
              "Mode of operation: `csp` cyclic position, `csv` cyclic velocity (the position loop is in the "
              "master), `cst` cyclic torque (the velocity loop is, too), "
              "`ip` interpolated position, `pp` profile position for slow axes."},
             {"counts_per_mm counts_per_deg",
              "Counts of the drive for a mm, or for a degree. The joint's range must "
              "fit into 32 bits."},
             {"reverse", "Whether the motor turns the other way."},
             {"absolute",
              "Whether the encoder knows its position at power-on, so that nothing needs homing."},
             {"velocity_gain_1_s", "Gain of the master's position loop with `mode = \"csv\"` or `\"cst\"`."},
             {"torque_gain_N_s_mm torque_gain_Nm_s",
              "Gain of the master's velocity loop: force for a speed that is missing. `mode = \"cst\"` needs "
              "it."},
             {"integral_time_s", "Integral time of that loop."},
             {"rated_force_N rated_torque_Nm",
              "The joint's force or torque at the motor's rated torque, which is 1000 in 0x6071, 0x6077 and "
              "0x60B2. Left out: by the data sheet's rated torque (0x6076) and counts of a motor's turn. "
              "Where "
              "torques are told, one of the two must be there."},
             {"following_error_mm following_error_deg",
              "Distance between setpoint and the measurement that belongs to it that is the fault "
              "`following_error`; "
              "0 does not watch it."},
             {"homing_method",
              "Number of the drive's homing method, as CiA 402 has them; 5 searches the home switch and "
              "the index behind it. 0, 15, 16, 31, 32 and 36 are no methods; 0 is legal with `absolute`. "
              "Negative "
              "numbers are the maker's own, which `trunnion run` cannot rehearse."},
             {"home_mm home_deg", "Position of the joint at the home point.",
              "0, or the end of its range nearest to it", "within the joint's range"},
             {"square_mm square_deg",
              "How far this motor's home switch stands beyond the square gantry, in the joint's positive "
              "direction. Only with a `[[drives.gantry]]`."},
             {"homing_speed_mm_s homing_speed_deg_s",
              "Speed of the search for the switch; at most the joint's own."},
             {"index_speed_mm_s index_speed_deg_s", "Speed of the search for the zero."},
             {"quick_stop_factor",
              "The drive's quick stop brakes with so many times the joint's acceleration limit."},
             {"torque",
              "Whether the drive tells its torque (0x6077) every period. It then stands in the messages of "
              "faults, and `trunnion tune` and `trunnion scope` have it."},
             {"sto",
              "How the drive tells that its Safe Torque Off is active: \"0x6041:14\" for bit 14 of its "
              "statusword, \"0x60FD:3\" for bit 3 of its inputs, with ! in front where the bit is off then."},
             {"limit_switches", "Whether bits 0 and 1 of 0x60FD are limit switches to be watched."},
             {"home_group",
              "Joints of a lower number are homed before those of a higher one, those of the same together."},
             {"home_final_mm home_final_deg",
              "Where the joint goes when it has homed, as fast as it searched.", "it stays where homing ends",
              "within the joint's range"},
             {"encoder_offset_mm encoder_offset_deg",
              "With `absolute`: the joint's position where the encoder counts zero."},
             {"drive_limits",
              "The drive's own range (0x607D) and following error (0x6065): `check` warns where they are "
              "tighter "
              "than the joint's, `set` writes the joint's."},
             {"following_error_ms",
              "How long the drive lets its own following error (0x6066) last; with `drive_limits`, as that "
              "says. It "
              "needs a following error.",
              "as the drive has it"},
             {"at_shutdown",
              "What the drive does when it is shut down (0x605B): it lets the motor coast, or brakes by its "
              "ramp first.",
              "as the drive has it"},
             {"at_disable", "The same when it is told to let go (0x605C).", "as the drive has it"},
             {"at_halt", "How the drive brakes when it is told to halt (0x605D).", "as the drive has it"},
             {"velocity_unit",
              "The drive's unit of velocity, as \"rpm\", \"0.1 rpm\" or \"counts/s\". It is written to the "
              "drive "
              "(0x60A9) where that can be, else compared. Left out: the unit of the data sheet, "
              "without one counts/s."},
             {"acceleration_unit",
              "The same of its ramps, as \"rpm/s\" or \"counts/s^2\" (0x60AA). Left out: that of the data "
              "sheet, "
              "without one the unit of velocity a second."},
             {"counts_per_revolution",
              "Counts of one revolution, for units such as rpm; 0: by the data sheet's feed (0x6092), or "
              "encoder "
              "and gear (0x608F, 0x6091)."},
             {"interpolation_period",
              "The form in which the drive wants to be told the period (0x60C2), as [10, -3] for 10 ms.",
              "in whole milliseconds if it can be, within the data sheet's limits"},
             {"skip",
              "Objects that are not written at bring-up, as \"0x6085\" or \"0x60C2:2\". They are still read "
              "where "
              "they are compared."},
             {"vendor",
              "The maker's number that the drive must tell (0x1018), by itself the data sheet's; 0 takes "
              "any."},
             {"product", "The product's number that it must tell, by itself the data sheet's; 0 takes any."},
         }},
        {"Feed-forward",
         {{"feed_forward", ""}},
         "What drives are told beside the place, from the plan's own speed and acceleration. "
         "[drives.md](drives.md) has the figures.",
         {
             {"velocity",
              "Whether drives in cyclic position mode are told the velocity (0x60B1), and those in cyclic "
              "velocity mode the plan's own."},
             {"torque",
              "Whether drives in a cyclic mode are told the torque that the joint's model asks for "
              "(0x60B2)."},
             {"delay_periods",
              "The moment that velocity and torque are for, in periods behind that of their setpoint. -0.5 "
              "is "
              "the middle of the way there, which suits a drive that goes evenly from one setpoint to the "
              "next. A drive that takes offsets up later needs more."},
         }},
        {"The model of a joint",
         {{"feed_forward.joint", ""}},
         "What the motor has to overcome. `trunnion tune` measures it and writes this table.",
         {
             {"joint", "The joint.", "", "the name of a joint"},
             {"inertia_kg inertia_kg_m2", "Mass, or moment of inertia, that the motor moves, with its own."},
             {"viscous_N_s_mm viscous_Nm_s", "Friction that grows with the speed."},
             {"coulomb_N coulomb_Nm", "Friction that does not; against the motion."},
             {"coulomb_speed_mm_s coulomb_speed_deg_s",
              "Below this speed that friction grows evenly from 0, so that a drive at rest is not pushed to "
              "and fro."},
             {"gravity_N gravity_Nm", "What holds the joint against its weight."},
             {"imbalance_Nm", "What holds a rotary joint against its weight where that is greatest."},
             {"imbalance_at_deg", "Where that is."},
             {"cogging_pitch_mm cogging_pitch_deg", "The way after which the table of cogging repeats.",
              "required with a table"},
             {"cogging_N cogging_Nm",
              "Force that the motor's cogging asks for, at even places of the pitch from 0 on.", "no cogging",
              "2 to 4096 numbers"},
         }},
        {"A gantry",
         {{"drives.gantry", "canopen"}},
         "One joint on two to four motors, a `[[drives.node]]` each. The motors home each by its own switch; "
         "then "
         "they are drawn to one place, and only then the joint is homed.",
         {
             {"joint", "The joint with several motors.", "", "the name of a joint"},
             {"apart_mm apart_deg",
              "Distance between two motors, beyond what they should have, that is the fault "
              "`gantry_parted`."},
             {"apart_homing_mm apart_homing_deg", "The same while each motor looks for its switch.",
              "five times `apart_mm`"},
             {"squaring_speed_mm_s squaring_speed_deg_s",
              "How fast the motors are drawn to one place, at power-on and behind homing."},
         }},
        {"A drive's habits",
         {{"drives.node.habits", "canopen"}},
         "What a drive does otherwise than CiA 402 has it.",
         {
             {"mode_display",
              "Whether its 0x6061 is there and true; else the mode that it was told is believed, ten periods "
              "later."},
             {"follows_bit", "Whether bit 12 of its statusword tells that it follows its setpoints."},
             {"homing_reached", "Whether it sets bit 10 beside bit 12 when it has homed."},
             {"stands_to_switch", "Whether it changes its mode at a standstill only."},
             {"pdo_order",
              "The only order in which it lets a PDO be mapped: `off` its identifier with bit 31, `type` of "
              "transmission, `clear` the count to 0, `map` the objects, `count` them, `on` the identifier. "
              "Without "
              "it, that order.",
              "", "each once; off and clear before map, count, on"},
             {"fixed_pdos",
              "PDOs that carry what the data sheet says and cannot be mapped anew, as [\"RPDO1\", "
              "\"TPDO1\"]. Their "
              "mapping is compared.",
              "", "RPDO1 to RPDO4, TPDO1 to TPDO4"},
             {"home_offset",
              "`position`: 0x607C is what the drive counts at the home point; `zero`: where its zero lies, "
              "seen "
              "from there."},
         }},
        {"An object to be written",
         {{"drives.node.write", "canopen"}},
         "Further objects, written at every bring-up in this order.",
         {
             {"index", "Index of the object, as 0x2110. It must be in the data sheet."},
             {"sub", "Sub-index."},
             {"value", "What is written."},
         }},
        {"Emulated drives on CAN",
         {{"drives.emulation", "canopen"}},
         "Beside the keys of simulated drives.",
         {
             {"index_pitch_mm index_pitch_deg",
              "Distance between two index pulses of the encoder; at least twice `index_distance`."},
             {"home_switch_width_mm home_switch_width_deg",
              "Length over which the home switch is closed, with the homing methods that look for it from "
              "both "
              "sides (7 to 14, 23 to 30)."},
             {"sync_periods_max", "Periods without SYNC after which an emulated drive faults."},
             {"probe_length_mm", "Length of the emulated touch probe, from the spindle nose to the ball."},
         }},
    }};

const ChapterMeaning kSlowDriveMeanings = {
    "Slow drives on Modbus",
    "Positioning drives with the words of CiA 402 in their registers, `type = \"modbus\"`, for machines "
    "whose period "
    "allows it.",
    {
        {"The drives together",
         {{"drives", "modbus"}},
         "",
         {
             {"missed_max", "Periods without an answer until a drive counts as lost."},
             {"enable_timeout_s", "How long a drive may take from power to enabled."},
             {"homing_timeout_s", "How long homing may take."},
         }},
        {"A line",
         {{"drives.line", "modbus"}},
         "A line of its own, which no device of `[modbus]` shares. It must serve all its drives in 70 % of a "
         "period.",
         {
             {"name", "What messages and other tables call the line."},
             {"address", "As \"rtu:/dev/ttyUSB0:115200:E\" or \"tcp:10.0.0.5:502\".", "",
              "`tcp:HOST[:PORT]` or `rtu:DEVICE[:BAUD[:PARITY]]`"},
             {"timeout_s", "How long an answer may take."},
         }},
        {"A drive",
         {{"drives.axis", "modbus"}},
         "One for each joint.",
         {
             {"joint", "The joint that the drive moves.", "", "the name of a joint"},
             {"line", "The `name` of its line.", "the only line; required with several",
              "the name of a line"},
             {"unit", "The drive's address on the line."},
             {"mode",
              "`pp`: profile position, a new target whenever the drive has taken the last; `csp`: cyclic "
              "position."},
             {"command",
              "First of four holding registers: controlword, mode, target position with the high word "
              "first."},
             {"answer", "First of four registers: statusword, mode, position with the high word first."},
             {"answer_table", "Whether these are input or holding registers."},
             {"turnaround_ms", "The drive's own time for an answer."},
             {"counts_per_mm counts_per_deg", "Counts of the drive for a mm, or for a degree."},
             {"reverse", "Whether the motor turns the other way."},
             {"absolute",
              "Whether the encoder knows its position at power-on, so that nothing needs homing."},
             {"following_error_mm following_error_deg",
              "Distance between setpoint and measurement that is the fault "
              "`following_error`; 0 does not watch it."},
         }},
    }};

}  // namespace trn
