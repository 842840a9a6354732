#include "app/cli/config_meanings.h"

namespace trn {

const ChapterMeaning kCorrectionMeanings = {
    "Corrections",
    "What makes the real machine reach the programmed place. A correction that has no section is not there. "
    "[corrections.md](corrections.md) tells what each does and how its numbers are measured.",
    {
        {"Switching",
         {{"corrections.geometric", ""},
          {"corrections.joint_table", ""},
          {"corrections.screw", ""},
          {"corrections.deflection", ""}},
         "Every correction has these.",
         {
             {"enabled", "Whether the correction acts when the machine starts."},
             {"m_on", "M code by which a program switches the correction on, as \"M421\".", "none",
              "M0 to M999, unused"},
             {"m_off", "M code by which a program switches it off.", "none", "M0 to M999, unused"},
         }},
        {"Budget of what acts behind the plan",
         {{"corrections.joint_table", ""}, {"corrections.screw", ""}, {"corrections.deflection", ""}},
         "In `[corrections.joint_table]` these are the bounds of the backlash alone.",
         {
             {"limit_mm limit_deg",
              "The most that the correction may move a joint. The planner keeps this strip of every range "
              "free."},
             {"reserve",
              "Share of the joints' velocity, acceleration and jerk that is kept for the correction: a "
              "larger one "
              "makes it quicker and the program slower."},
         }},
        {"Geometric errors",
         {{"corrections.geometric", ""}},
         "For machines of `type = \"serial\"` with three linear and up to two rotary joints.",
         {
             {"mode",
              "`position` puts the tool's tip right with the linear joints; `full` also the tool's axis with "
              "the "
              "rotary ones."},
             {"model",
              "How tilts are put together: `linear` as small angles, `exact` as rotations. They differ only "
              "by "
              "squares of the tilts."},
             {"limit_mm", "The most that a linear joint is moved."},
             {"limit_deg",
              "The most that a rotary joint is turned. Near a pole, where more would be needed, part of the "
              "axis "
              "error is left."},
             {"reserve",
              "Share of the joints' limits with which the difference fades when the correction changes at "
              "rest, as with another tool."},
         }},
        {"Errors of one axis",
         {{"corrections.geometric.axis", ""},
          {"io.errors.axis", "simulated"},
          {"io.emulation.errors.axis", "modbus"},
          {"drives.emulation.errors.axis", "canopen"}},
         "Names as in ISO 230-1: x, y, z are shifts along, a, b, c tilts about X, Y, Z. `trunnion ballbar "
         "identify` and `trunnion ball fit` find those of rotary axes and write the section. The tables "
         "below "
         "`[io]` and `[drives]` say where the axes of the simulated machine really lie, as its probe feels.",
         {
             {"joint", "The axis.", "", "the name of a joint"},
             {"ex0_mm ey0_mm ez0_mm", "Where the axis lies beside its nominal place."},
             {"ea0_arcsec eb0_arcsec ec0_arcsec",
              "How the axis is tilted. Of a linear axis they are its squareness: they turn its way, not what "
              "it "
              "carries."},
         }},
        {"Errors along an axis",
         {{"corrections.geometric.axis.table", ""},
          {"io.errors.axis.table", "simulated"},
          {"io.emulation.errors.axis.table", "modbus"},
          {"drives.emulation.errors.axis.table", "canopen"}},
         "Measured at places along the axis and smooth between them.",
         {
             {"at_mm at_deg", "Places along the joint at which the errors are known; they must rise.",
              "required; the unit is the joint's"},
             {"periodic", "Of a rotary axis: the table spans 360 degrees and goes on with its beginning."},
             {"ex_mm ey_mm ez_mm",
              "Shifts at these places, one number each, up to 10 mm. A smooth curve goes through them. One "
              "that is "
              "steeper than 0.02 (rotary: 5 mm/rad) is refused.",
              "none"},
             {"ea_arcsec eb_arcsec ec_arcsec",
              "Tilts at these places, one number each, up to 7200. A curve steeper than 0.001 rad/mm "
              "(rotary: 0.02) "
              "is refused.",
              "none"},
         }},
        {"Joint tables",
         {{"corrections.joint_table", ""}},
         "The error of each joint alone. `trunnion joint-table fit` writes the section from measurements.",
         {
             {"table_limit_mm table_limit_deg",
              "The most that the tables may add anywhere in the joints' ranges; a "
              "table that adds more is refused."},
         }},
        {"Table of a joint",
         {{"corrections.joint_table.joint", ""}},
         "",
         {
             {"joint", "The joint; one table each.", "", "the name of a joint"},
             {"slope",
              "Error of the scale: setpoints are multiplied by 1 + slope. It and the steepest part of the "
              "table may not exceed 0.02 together."},
             {"backlash_mm backlash_deg",
              "Gap between driving forward and driving backward, the same everywhere. Half of it, with that "
              "of the "
              "table, must be within `limit_mm` or `limit_deg` of the section."},
             {"hysteresis_mm hysteresis_deg", "The joint has reversed when it has gone back by this much."},
             {"at_mm at_deg", "Places along the joint at which its error was measured.",
              "none: slope and backlash alone"},
             {"forward_mm forward_deg",
              "How far beyond its setpoint the joint goes at these places, driven forward.",
              "required with the places"},
             {"backward_mm backward_deg", "The same driven backward.", "as forward"},
         }},
        {"Growth of ball screws",
         {{"corrections.screw", ""}},
         "For axes without linear scales.",
         {
             {"update_s", "Time between two steps of the heat model."},
             {"slope_max",
              "Greatest growth per length that the correction follows; the planner keeps room for it. "
              "0.0005 is what 40 K make of steel."},
             {"rate_um_s",
              "Fastest change of the correction at one place, so that no sensor can make a step."},
         }},
        {"A screw",
         {{"corrections.screw.axis", ""}, {"drives.screw", "*"}},
         "`[[corrections.screw.axis]]` is what the correction believes of a screw. `[[drives.screw]]` is a "
         "screw of the simulated machine as it is in truth, with whatever drives. It warms up as the machine "
         "moves.",
         {
             {"joint", "The joint that the screw moves.", "", "the name of a linear joint"},
             {"mounting",
              "How the screw is held: `fixed-free` grows away from the fixed bearing, `fixed-fixed` cannot "
              "grow at "
              "its ends, `fixed-preload` was stretched at assembly."},
             {"fixed_bearing_mm", "Where the fixed bearing is, on the joint's own scale."},
             {"far_bearing_mm", "Where the other bearing is. The joint's range must lie between the two."},
             {"stretch_mm", "By how much the screw was stretched at assembly.",
              "required with `mounting = \"fixed-preload\"`"},
             {"alpha_per_K", "Thermal expansion of the screw; the default is that of steel."},
             {"diameter_mm", "The screw's diameter."},
             {"nut_friction_N", "Friction of the nut, which warms the screw where it runs."},
             {"bearing_friction_N",
              "Friction of each bearing, as a force at the nut, which warms the screw's ends."},
             {"cooling_W_m2K", "How well the screw's surface gives its heat to the air."},
             {"sensor",
              "Name of a temperature's channel: a Modbus value as \"thermo.x_nut\", what `trunnion sensor` "
              "sends, or "
              "that of a simulated screw, which sends it. A machine has up to 16.",
              "none: the heat model alone"},
             {"sensor_at_mm", "Where the sensor is, counted from the fixed bearing.",
              "the middle of the screw", "0 to the screw's length"},
         }},
        {"The sensor of a screw's correction",
         {{"corrections.screw.axis", ""}},
         "All but `encoder` go with `sensor`.",
         {
             {"encoder", "`linear` says that a scale sees the nut itself: then nothing is corrected."},
             {"reference_C", "Temperature at which the axis is right."},
             {"min_C", "A lower reading cannot be true."},
             {"max_C", "A higher reading cannot be true.", "", "`min_C` to 200"},
             {"rate_max_K_s",
              "A reading that changes faster cannot be true. One that stays there is believed after "
              "`timeout_s`."},
             {"timeout_s", "A sensor that says nothing for so long is silent."},
             {"on_dropout",
              "While the sensor is silent or cannot be true, the heat `model` goes on, or the last growth "
              "is held."},
         }},
        {"The sensor of a simulated screw",
         {{"drives.screw", "*"}},
         "",
         {
             {"air_C", "Temperature of the air, and of the screw at the start."},
             {"resolution_K", "Steps of the sensor's reading; 0: none."},
             {"silent_from_s", "The sensor says nothing from this time on, counted from the start."},
             {"silent_to_s", "It speaks again from this time on."},
         }},
        {"Deflection of the tool",
         {{"corrections.deflection", ""}},
         "For a stage of linear motors that tell their current, X and Y first among the joints: "
         "[micromill.md](micromill.md).",
         {
             {"gain",
              "Share of the tool's estimated bending that the path is moved against; 0 only estimates."},
             {"stiffness_N_mm",
              "The tool's stiffness along X and along Y; `trunnion micromill stiffness` measures it.", "",
              "two, above 0"},
             {"networks",
              "File with the friction that `trunnion micromill train` has learnt, beside the config. Without "
              "it loads "
              "are reported and nothing is corrected."},
             {"lag_s", "Time constant of the low pass that smooths the estimate."},
             {"rate_mm_s", "Fastest change of the path's shift."},
             {"innovation_alarm",
              "The load filter counts as wrong, and the correction runs back to zero, when its innovation is "
              "so many "
              "times that of the training."},
             {"measure_every", "The drives tell their position once in so many periods."},
         }},
        {"The motors of the stage",
         {{"corrections.deflection.X", ""}, {"corrections.deflection.Y", ""}},
         "The load filter's gain follows from these.",
         {
             {"gain_mm_s2_A", "Acceleration of the motor with its load, by current."},
             {"damping_1_s", "Viscous damping over mass."},
             {"mass_kg", "Moving mass."},
             {"sigma_current_A", "Noise of the current, standard deviation."},
             {"sigma_load_rate_N_s", "How fast the load changes, standard deviation."},
             {"sigma_position_mm", "Noise of the position, standard deviation."},
         }},
    }};

}  // namespace trn
