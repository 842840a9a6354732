#include "app/cli/config_meanings.h"

namespace trn {

const ChapterMeaning kMachineMeanings = {
    "Machine and joints",
    "What every config has.",
    {
        {"The machine",
         {{"machine", ""}},
         "",
         {
             {"name",
              "The machine's name. It becomes part of the names of channels and files of the daemon, so the "
              "daemon takes 1 to 40 characters and no `/`."},
             {"period_s",
              "Time from one setpoint to the next, for example 0.001. Drives on a bus must be able to "
              "exchange "
              "within it; a config whose bus cannot is refused with the smallest period that would do."},
         }},
        {"A joint",
         {{"joint", "linear"}, {"joint", "rotary"}},
         "One table for each motor, up to nine, in the order of the columns of a trace. No setpoint ever "
         "exceeds "
         "these limits, whatever program, override and corrections ask for.",
         {
             {"name",
              "What messages, traces and other tables call the joint, as \"X\". Letters, digits, `_` and "
              "`-` are legal. Each name is there once, and none is a column of every trace, as `t_s` or "
              "`p_x`."},
             {"type",
              "Whether the joint moves in mm or turns in degrees. It decides which of the keys below it "
              "has."},
             {"endless",
              "Whether a rotary joint turns as far as one likes. It has no `min_deg` and `max_deg` then, and "
              "its "
              "drive may count beyond 32 bits."},
             {"min_mm min_deg", "Lower end of the joint's range; not with `endless`."},
             {"max_mm max_deg",
              "Upper end of the range; it must lie above the lower one. Not with `endless`."},
             {"velocity_mm_s velocity_deg_s",
              "Greatest velocity. Rapid moves reach it where the other limits let them."},
             {"acceleration_mm_s2 acceleration_deg_s2", "Greatest acceleration."},
             {"jerk_mm_s3 jerk_deg_s3",
              "Greatest rate at which the acceleration changes. A small jerk is gentle to the machine; a "
              "frequent "
              "choice is the acceleration over 0.05 s."},
         }},
    }};

const ChapterMeaning kKinematicsMeanings = {
    "Kinematics",
    "How the joints carry tool and work. [new_machine.md](new_machine.md) walks through a new one.",
    {
        {"Kind of machine",
         {{"kinematics", "*"}},
         "",
         {{"type",
           "`serial` is any machine whose axes follow each other, from a three-axis mill to swivel heads "
           "and cradles. `hexapod` stands on six legs. `rail_mill` hangs a platform on four sliders with "
           "links."}}},
        {"Axes in a row: `type = \"serial\"`",
         {{"kinematics.tool_branch", "serial"}, {"kinematics.work_branch", "serial"}},
         "One entry an axis, from the machine's base outwards: the tool branch ends at the spindle nose, the "
         "work "
         "branch at the table. Every joint stands in exactly one of them. With all joints and tilts at zero "
         "the tool must be parallel to Z of the table.",
         {
             {"joint",
              "The joint that moves this axis. An entry without `joint` and `direction` is an offset alone.",
              "none: an offset alone", "the name of a joint"},
             {"direction",
              "The way that the axis moves, or the line that it turns about right-handed, as the joint's "
              "value "
              "grows. Any length but 0 and any direction, as [0, 0.7071, 0.7071] for an axis at 45 degrees.",
              "required with `joint` and `tilt_deg`"},
             {"offset_mm",
              "In the tool branch the way from the axis before to this one, in the work branch the same, "
              "with all "
              "joints at zero. The head's pivot length stands here."},
             {"tilt_deg",
              "An axis that is clamped at this angle: a right-angle head, or a swivel head set by hand. It "
              "turns "
              "about `direction` and carries what is behind it. It stands in an entry without `joint`, in "
              "the tool "
              "branch only.",
              "none: nothing is turned", "-180 to 180"},
             {"word", "The word of the program that moves this axis; no two axes have the same.",
              "the joint's name if that is a legal word; else required",
              "`X`, `Y`, `Z` of a linear joint; `A`, `B`, "
              "`C` of a rotary one"},
             {"sense",
              "1 if the joint counts as its word does, -1 against it: for the primed axes of ISO 841, which "
              "carry "
              "the work.",
              "", "1 and -1 only"},
         }},
        {"Machines with a moving platform",
         {{"kinematics", "hexapod"}, {"kinematics", "rail_mill"}},
         "",
         {
             {"carries",
              "What the platform moves. `work`: it is the table, and the spindle stands still in the base. "
              "`spindle`: it holds the spindle over work that lies on the base."},
             {"spindle_mm",
              "Place of the spindle nose: in the base if the platform carries the work, in the platform if "
              "it "
              "carries the spindle."},
             {"home_mm",
              "Place of the platform in the base at home, where it stands upright. The search for the "
              "platform's "
              "pose from the joints starts here, and the platform must be able to stand here."},
             {"conditioning_min",
              "How evenly stiff the platform must be: 1 is the same in every direction, 0 is singular. Poses "
              "below "
              "this value are refused as singular; 0 judges nothing."},
         }},
        {"Hexapod: `type = \"hexapod\"`",
         {{"kinematics", "hexapod"}},
         "Six linear joints, one a leg, in the order of the tables `leg`.",
         {
             {"joint_angle_deg_max",
              "How far either end of a leg may swing from where it points at home, as the bearings allow. "
              "Poses "
              "beyond it are refused.",
              "any angle"},
             {"leg_distance_mm_min",
              "How near the centre lines of two legs may come: their diameter and a margin. 0 does not judge "
              "it."},
             {"free_turn_deg_max",
              "How far the platform may turn about the tool, which no program sees, to make the legs more "
              "alike. "
              "0 does not turn it."},
         }},
        {"A leg",
         {{"kinematics.leg", "hexapod"}},
         "Six tables.",
         {
             {"base_mm", "The leg's joint in the base."},
             {"platform_mm", "The leg's joint in the platform."},
         }},
        {"A rail: `type = \"rail_mill\"`",
         {{"kinematics.rail", "rail_mill"}},
         "Four tables, one a linear joint, in the joints' order. A slider runs on each rail, and a link of "
         "fixed "
         "length leads from it to the platform.",
         {
             {"rail_mm",
              "Where the slider counts from: its joint is at this place of the base when the joint's value "
              "plus `offset_mm` is 0."},
             {"direction", "The way the slider moves as the joint's value grows; any length but 0."},
             {"platform_mm", "The link's joint in the platform."},
             {"link_mm", "Length of the link from joint to joint."},
             {"offset_mm",
              "Shifts the zero of the joint's scale along the rail: the slider stands at the joint's "
              "value plus this."},
             {"sign",
              "On which side of the platform the slider was assembled: 1 if it lies ahead along `direction`, "
              "-1 "
              "behind.",
              "", "1 and -1 only"},
         }},
    }};

const ChapterMeaning kProgramMeanings = {
    "Programs and tool changes",
    "What G-code leaves to the machine. [gcode.md](gcode.md) describes the language.",
    {
        {"The language",
         {{"program", ""}},
         "",
         {
             {"path_mode",
              "The path mode at the program's start. G64 rounds corners within the tolerance, G61 follows "
              "the path exactly. G61.1 also stops at the end of every move."},
             {"units",
              "The unit at the program's start and for typed lines, as G21 or G20 has it. Keys of this file "
              "are in "
              "mm whatever it says."},
             {"tolerance_mm", "How far the tool's tip may leave the programmed path under G64 without P."},
             {"tolerance_deg", "How far the tool's axis may leave the programmed one under G64 without R."},
             {"arc_tolerance_mm",
              "An arc is refused if its radius at the start and at the end differ by more than "
              "this. In inch programs it is 2.54 times as much."},
             {"arc_tolerance_share",
              "Large arcs may differ by this share of their radius instead, but never by more than 100 times "
              "`arc_tolerance_mm`."},
             {"gouge_check",
              "What happens if cutter compensation (G41, G42) would cut into the finished contour. The "
              "program is refused, or goes on with a warning, or nobody looks."},
             {"peck_clearance_mm",
              "In G73, G83 and G183 the rapid move back into the hole stops this far above the depth that is "
              "drilled "
              "already. In G73 the drill also retracts by this much."},
             {"g183_retract_mm", "Clearance above the hole of G183 without R."},
             {"safe_z_mm",
              "Height in machine coordinates at which the machine crosses over the work when a program "
              "begins "
              "further down (`--from`).",
              "the higher of both ends, with a warning"},
             {"block_delete",
              "Whether lines that begin with `/` are skipped, until `trunnion switch block-delete` says "
              "otherwise."},
             {"optional_stop",
              "Whether M1 stops, until `trunnion switch optional-stop` says otherwise; also in "
              "`#<_optional_stop>`."},
             {"dry_run_up_mm",
              "How far the tool stays away from the work in a dry run (`trunnion switch dry-run on`): along "
              "Z, or with RTCP along the tool's axis, as far as the joints' ranges leave room."},
             {"end_required",
              "Whether a file must end with M2, M30 or `%`: true refuses one that just ends, false says "
              "nothing.",
              "a warning"},
             {"wrapped",
              "Rotary words that are angles on a circle. An absolute word takes the short way round, so "
              "that `C350` and then `C10` turns by 20 degrees.",
              "", "`A`, `B`, `C`"},
             {"wrapped_way",
              "Which way round such a word goes: `short`, or `sign` as on LinuxCNC. There C-10 turns "
              "backwards to "
              "10 degrees, C10 forwards, and 360 or more is an error."},
             {"great_circle",
              "At the program's start the tool's axis goes the shortest way (as after `ORIVECT`) instead of "
              "the "
              "rotary words turning evenly."},
             {"rtcp_on",
              "Words of other controls that switch tool-centre-point control on, as [\"TRAORI\", "
              "\"M128\"]: M and an unused number, or a word of letters."},
             {"rtcp_off", "Words that switch it off, as [\"TRAFOOF\", \"M129\"]."},
             {"great_circle_on", "Words from which on the tool's axis goes on a great circle."},
             {"great_circle_off", "Words from which on the rotary words turn evenly again."},
             {"ignored",
              "Words that mean nothing here and are passed over with one warning. Also a G code with its "
              "words, as "
              "\"G187\", or with values that must be there, as \"G5 P10000\"."},
             {"user_m", "M codes that only appear as an event, as [\"M110\"].", "", "M0 to M999, unused"},
             {"sub_path",
              "Folders in which files of sub-programs are looked for, in this order, from the "
              "program's own folder on unless they begin with `/`."},
             {"line_length_max", "Longest line of a program, in bytes."},
             {"sub_depth_max", "How deep sub-programs may call each other."},
         }},
        {"An M code of your own",
         {{"program.m_code", ""}},
         "It needs either `call` or `output`.",
         {
             {"code", "The code, as \"M111\".", "", "M0 to M999, unused"},
             {"call", "The sub-program that the code calls, with the code's P and Q as #1 and #2."},
             {"output", "The digital output that the code switches at rest, as M64 and M65 do.", "none"},
             {"on", "Whether the output is switched on (as M64) or off (as M65)."},
         }},
        {"Tool changes",
         {{"tool_change", ""}},
         "[operator.md](operator.md#tool-changes) tells what happens at M6.",
         {
             {"confirm",
              "Who says that the tool which M6 asks for is in the spindle. It is the operator with "
              "`resume`, an input, a sub-program that changes it, or nobody."},
             {"input", "The digital input whose rise says so. It needs a section `[io]`.",
              "required with `confirm = \"input\"`; else refused"},
             {"call",
              "The sub-program that changes the tool; #1 is the new tool, #2 the old one, #3 and #4 "
              "their pockets.",
              "required with `confirm = \"sub-program\"`; else refused"},
         }},
        {"A spindle that is an axis",
         {{"spindle_axis", ""}},
         "The spindle's drive is a joint of the machine. [gcode.md](gcode.md#a-spindle-that-is-an-axis) "
         "shows it "
         "at work. Its greatest speed and its acceleration are those of the joint.",
         {
             {"axis", "The word of the spindle's joint, which needs `endless = true`."},
             {"axis_on",
              "Words of the program that make an axis of the spindle: it stops, and turns to where the axis "
              "stands."},
             {"axis_off", "Words that make a spindle of it again; the program's end does so as well."},
             {"m3",
              "Which way the joint turns at M3, clockwise as seen from the spindle. It is `negative` for a "
              "joint in the tool branch with `direction` [0, 0, 1]."},
         }},
        {"Tangential knife",
         {{"tangential", ""}},
         "For a knife that a rotary axis turns about Z. [gcode.md](gcode.md#tangential-knife) shows it at "
         "work.",
         {
             {"axis", "The word of the axis that turns the knife. Its edge points along +X at 0 degrees."},
             {"on", "Words of the program from which the knife follows the path."},
             {"off", "Words that end it; the program's end does so as well."},
             {"corner_deg",
              "At a corner that turns by more than this the knife goes up, turns, and comes down again."},
             {"blend_deg",
              "At a corner that turns by no more than this the knife turns on its way, along both moves. It "
              "stands off the path by half of it at most. Between the two angles it turns on the spot, in "
              "the "
              "material."},
             {"lift_mm", "How far it goes up at a sharp corner: more than the material is thick."},
         }},
    }};

const ChapterMeaning kPlannerMeanings = {
    "Planner",
    "",
    {{"",
      {{"planner", ""}},
      "Most machines need at most `tolerance_mm_max`. "
      "[planner.md](planner.md) shows what the planner does.",
      {
          {"tolerance_mm_max",
           "A program that asks for more tolerance (G64 P) is refused. It guards against a P that was meant "
           "otherwise."},
          {"compress",
           "Whether runs of tiny moves become smooth curves within the tolerance. Without it every corner is "
           "rounded alone, which is slower."},
          {"acceleration_share",
           "Share of the joints' acceleration that the plan uses. The rest lets override and hold act at any "
           "moment."},
          {"jerk_share", "The same share of the jerk."},
          {"buffer_s",
           "Motion that is planned ahead of the tick. Longer helps a busy host; it is never less than four "
           "times "
           "what a hold takes."},
          {"memory_mb",
           "Memory that the daemon's process for programs may use. A program that needs more is refused, and "
           "the "
           "machine stands where it stood."},
      }}}};

const ChapterMeaning kHostMeanings = {
    "Host: real time and messages",
    "",
    {
        {"Real time",
         {{"realtime", ""}},
         "For the daemon's tick. [operator.md](operator.md#lateness) has more.",
         {
             {"priority", "Priority of the tick under SCHED_FIFO, 1 to 98; 0 asks for none."},
             {"cpu",
              "Processor that the tick is bound to, counted from 0; -1 is any. Best is one that is isolated "
              "from the rest (`isolcpus`)."},
             {"lock_memory",
              "Whether the daemon's memory is locked, so that the tick never waits for a page."},
             {"late_periods_max",
              "The fault `cycle_overrun` comes when a tick begins more periods late than this; 0 never.",
              "5 with real drives, 0 with simulated ones"},
         }},
        {"The scope",
         {{"scope", ""}},
         "What `trunnion scope` can look back on, and what is kept of a fault. "
         "[operator.md](operator.md#scope) has "
         "more.",
         {
             {"seconds",
              "How much of all signals the daemon keeps in memory, at most 100,000 periods; a second at 1 ms "
              "takes about 1 MB."},
             {"after_fault_s", "The file of a fault goes on so long behind it."},
             {"fault_files", "How many such files are kept beside the session's log; 0: none."},
         }},
        {"Messages",
         {{"lcm", ""}},
         "",
         {
             {"url",
              "Where the daemon tells status and motion to whoever listens: a group address of LCM. It hears "
              "nothing there. `ttl=0` keeps every message on this host; an empty text tells nothing."},
         }},
        {"Who may command the machine",
         {{"access", ""}},
         "Commands come over a Unix socket of this host. Root and the daemon's own user may do everything. "
         "Whoever "
         "may connect may also stop the machine.",
         {
             {"socket",
              "Path of the socket. An empty text: `trunnion-NAME.sock` in the folder of the machine's lock "
              "file."},
             {"look", "Group whose members may connect, and see state and motion."},
             {"operate",
              "Group whose members may, besides, move the machine: programs, MDI, jog, home, overrides, "
              "reset, "
              "sensor readings. An empty text: the group of `look`."},
             {"set_up",
              "Group whose members may, besides, change how the machine moves: switch corrections. An empty "
              "text: "
              "the group of `operate`."},
         }},
        {"Commands from other hosts",
         {{"gateway", ""}},
         "For `trunnion gateway`, and for clients with `--remote`. "
         "[operator.md](operator.md#another-computer) tells "
         "how to let one in.",
         {
             {"url",
              "The group address of LCM at which signed commands are taken, with a `ttl` of 1 or more for "
              "other "
              "hosts. An empty text: there is no gateway.",
              "", "`udpm://ADDRESS:PORT?ttl=N`, or empty"},
             {"counters",
              "File in which the gateway keeps the last counter of each key, so that nothing comes in twice. "
              "It must "
              "outlive restarts of the host. An empty text: `NAME.counters` in the service's own folder "
              "(`$STATE_DIRECTORY`).",
              "", "a whole path, or empty"},
             {"rate_hz_max",
              "Commands and sensor readings a second of one key. What stops the machine always passes."},
         }},
        {"A key that may send them",
         {{"gateway.key", ""}},
         "`trunnion key make FILE NAME` prints such a section.",
         {
             {"name", "Who holds the key; log and refusals name it.", "",
              "1 to 40 letters, digits and . _ @ -"},
             {"public", "The public key, or the path of a file that has it as its first line.", "",
              "44 characters of base64, or a path"},
             {"role",
              "What it may do, as the groups of `[access]`. Each may do what those before it may, and all "
              "may stop "
              "the machine."},
         }},
    }};

std::vector<const ChapterMeaning*> all_meanings() {
  return {&kMachineMeanings,    &kKinematicsMeanings, &kProgramMeanings,  &kPlannerMeanings,
          &kCorrectionMeanings, &kDriveMeanings,      &kCanMeanings,      &kSlowDriveMeanings,
          &kIoMeanings,         &kModbusMeanings,     &kSafetyMeanings,   &kSignalMeanings,
          &kDrawingMeanings,    &kHostMeanings,       &kOtherFileMeanings};
}

}  // namespace trn
