#include "app/cli/config_meanings.h"

namespace trn {

const ChapterMeaning kIoMeanings = {
    "Inputs, outputs, probe and spindle",
    "A machine without a section `[io]` has none of them: outputs do nothing, and words that need an answer "
    "are "
    "refused. [gcode.md](gcode.md#inputs-and-outputs) tells what programs do with them.",
    {
        {"All of them",
         {{"io", "simulated"}, {"io", "modbus"}},
         "",
         {
             {"type",
              "`modbus` takes values of the devices below; in `trunnion run` simulated ones stand there "
              "too."},
             {"spindle_timeout_s",
              "How long the spindle may take to turn, or to stand, as told; longer is a fault."},
         }},
        {"The spindle",
         {{"io.spindle", "simulated"}, {"io.spindle", "modbus"}},
         "",
         {{"encoder", "Whether threads (G33, G33.1, G76) may follow the spindle's encoder.",
           "true; false with `type = \"modbus\"`, which cannot have one"},
          {"rpm_max",
           "The greatest speed of the spindle. A greater S is refused, and G96 goes no faster; 0: no limit, "
           "and "
           "G96 needs its D."}}},
        {"The simulated spindle",
         {{"io.spindle", "simulated"}, {"io.emulation.spindle", "modbus"}},
         "",
         {
             {"acceleration_rpm_s",
              "How fast its speed changes; 0: any speed at once. Rigid tapping is planned by it."},
             {"lag_s", "Its speed follows with this time constant."},
             {"load_share", "Its speed waves by this share, as under an uneven cut."},
             {"load_hz", "How often it waves."},
         }},
        {"An input that follows an output",
         {{"io.wire", "simulated"}, {"io.emulation.wire", "modbus"}},
         "Simulated wiring: digital, or with the keys `analog_` analog.",
         {
             {"output analog_output", "Number of the output, as P of M62 or E of M67.", "one of the two"},
             {"input analog_input", "Number of the input that follows, as P or E of M66.", "one of the two"},
             {"delay_s", "The input follows when the output has kept its value for so long."},
         }},
        {"An input that changes by itself",
         {{"io.script", "simulated"}, {"io.emulation.script", "modbus"}},
         "",
         {
             {"at_s", "When, counted from the start."},
             {"input analog_input", "Number of the input.", "one of the two"},
             {"value", "What it becomes; 0 is off."},
         }},
        {"A block that a probe touches",
         {{"io.plate", "simulated"}, {"io.emulation.plate", "modbus"}, {"drives.emulation.plate", "canopen"}},
         "A simulated block on the table. It has a frame of its own, which lies in machine coordinates with "
         "every axis at zero. The tables of `[drives]` are for probes on CANopen drives, here and below.",
         {
             {"at_mm", "Where the block's own frame lies."},
             {"turn_deg", "How the frame is turned: about Z, X', Z'' as I J K of G68.2."},
             {"min_mm", "The corner with the least X, Y and Z, in the block's frame."},
             {"max_mm", "The opposite corner; each number must be greater than that of `min_mm`."},
         }},
        {"A bore in such a block",
         {{"io.plate.bore", "simulated"},
          {"io.emulation.plate.bore", "modbus"},
          {"drives.emulation.plate.bore", "canopen"}},
         "Round, from the block's top downwards. It must lie inside the block's sides.",
         {
             {"x_mm y_mm", "Its axis in the block's frame."},
             {"diameter_mm", "Its diameter."},
             {"depth_mm", "Its depth below the block's top.", "through the block"},
         }},
        {"A boss that a probe touches",
         {{"io.boss", "simulated"}, {"io.emulation.boss", "modbus"}, {"drives.emulation.boss", "canopen"}},
         "A simulated round pin.",
         {
             {"at_mm", "The middle of its top, in machine coordinates with every axis at zero."},
             {"turn_deg", "How its axis is turned from Z: about Z, X', Z'' as I J K of G68.2."},
             {"diameter_mm", "Its diameter."},
             {"height_mm", "How far it reaches down from its top."},
         }},
        {"A ball that a probe touches",
         {{"io.ball", "simulated"}, {"io.emulation.ball", "modbus"}, {"drives.emulation.ball", "canopen"}},
         "A simulated calibration ball, without its stem.",
         {
             {"at_mm", "Its centre, in machine coordinates with every axis at zero."},
             {"diameter_mm", "Its diameter."},
         }},
        {"The simulated probe",
         {{"io.probe", "simulated"}, {"io.emulation.probe", "modbus"}, {"drives.emulation.probe", "canopen"}},
         "",
         {{"tip_diameter_mm", "Diameter of the ball that stands on the tool's tip; 0: the tip is a point."}}},
        {"The simulated probe as it really is",
         {{"io.probe", "simulated"}, {"io.emulation.probe", "modbus"}},
         "",
         {
             {"length_mm",
              "Length of what is in the spindle, from the gauge point to the tip. With it the simulated tip "
              "is "
              "there whatever the program says, as on a machine.",
              "what the program says of the tool"},
             {"noise_mm", "Standard deviation of the gap at which a touch is felt."},
             {"seed", "Another one gives other noise; the same one gives the same."},
         }},
        {"Inputs and outputs on Modbus",
         {{"io", "modbus"}},
         "Names are those of values below, as \"box.vacuum\". What is written must be a coil or a holding "
         "register.",
         {
             {"digital_inputs", "The inputs 0, 1, 2 and so on of M66 P.", "", "values; at most 64"},
             {"digital_outputs", "The outputs of M62 to M65 P.", "", "values; at most 64"},
             {"analog_inputs", "The inputs of M66 E.", "", "values; at most 64"},
             {"analog_outputs", "The outputs of M67 and M68 E.", "", "values; at most 64"},
             {"mist", "Written 1 by M7 and 0 by M9.", "none", "a value"},
             {"flood", "Written 1 by M8 and 0 by M9.", "none", "a value"},
         }},
        {"A spindle on Modbus",
         {{"io.spindle", "modbus"}},
         "It needs `speed` or `run`.",
         {
             {"speed", "Written: the speed in rpm; without sign if there is `reverse`.", "none", "a value"},
             {"run", "Written: 1 turns, 0 stands.", "none", "a value"},
             {"reverse", "Written: 1 turns counterclockwise.", "none", "a value"},
             {"actual", "Read: the speed in rpm. Motion waits until it is near enough.", "none", "a value"},
             {"tolerance_rpm", "How near `actual` must be to the speed asked for."},
             {"at_speed", "Read: not 0 when the speed is reached.", "none", "a value"},
             {"fault", "Read: 0, or the inverter's fault code.", "none", "a value"},
         }},
    }};

const ChapterMeaning kModbusMeanings = {
    "Devices on Modbus",
    "Whatever is asked and told over Modbus. Its values are inputs and outputs by `[io]`, and sensors of "
    "corrections by "
    "their names. `trunnion modbus scan` and `read` find out what is on a line.",
    {
        {"A line",
         {{"modbus.line", ""}},
         "",
         {
             {"name", "What messages and other tables call the line."},
             {"address", "As \"tcp:10.0.0.5:502\" or \"rtu:/dev/ttyUSB0:19200:E\".", "",
              "`tcp:HOST[:PORT]` or `rtu:DEVICE[:BAUD[:PARITY]]`"},
             {"timeout_s", "How long an answer may take."},
         }},
        {"A device",
         {{"modbus.device", ""}},
         "The polls of a serial line's devices may take 70 % of its time.",
         {
             {"name", "The device's name: its values are called by it, as \"box.vacuum\"."},
             {"line", "The `name` of its line.", "the only line; required with several",
              "the name of a line"},
             {"unit", "The device's address on the line."},
             {"poll_s", "Its values are asked for this often."},
             {"stale_s", "Without an answer for so long the device is lost; longer than `poll_s`.",
              "five times `poll_s`"},
             {"retries", "How often a question is asked again before it counts as not answered."},
             {"required",
              "Whether it is a fault when the device is lost or its values cannot be true. If not, "
              "they only go stale."},
         }},
        {"A value",
         {{"modbus.device.value", ""}},
         "",
         {
             {"name",
              "The value's name beside the device's: `vacuum` of the device `box` is \"box.vacuum\"."},
             {"table",
              "Where it is: a coil or a discrete input (one bit), an input or a holding register (16 bits)."},
             {"address", "Its address, counted from 0."},
             {"signed", "Whether the register is a signed number."},
             {"scale", "The value is the register times this, as 0.1 for tenths of a degree.", "", "not 0"},
             {"min", "A lower value cannot be true."},
             {"max",
              "A higher value cannot be true; not less than `min`. If both are equal, every value can."},
         }},
        {"What an emulated device shows",
         {{"modbus.emulation", ""}},
         "For `trunnion-drives` and rehearsals.",
         {
             {"value", "The value, as \"thermo.x_nut\".", "", "a value"},
             {"start", "What it is at the start."},
             {"rate_per_s", "By how much it grows every second."},
         }},
    }};

const ChapterMeaning kOtherFileMeanings = {
    "Other files",
    "Files of the same form that belong to a machine. Files of true errors (`trunnion ballbar run --truth`, "
    "`trunnion joint-table measure --truth`) have the keys of `[corrections.geometric]` and "
    "`[corrections.joint_table]`.",
    {
        {"Script of faults",
         {{"fault", ""}},
         "`trunnion-drives --faults FILE`: what goes wrong with emulated drives and devices.",
         {
             {"at_s", "When, counted from the start."},
             {"bus", "The drive's bus, counted from 0 in the config's order."},
             {"node", "The drive's node id.", "this or `device`"},
             {"device", "The name of a Modbus device.", "this or `node`"},
             {"kind",
              "What goes wrong. Drives: `silent` sends nothing, `reset` goes off and on, `emergency` sends"
              " an emergency message and goes on, `fault` faults. `no_heartbeat` and `heartbeat_late` are "
              "as named, `drop` leaves Operation Enabled, `pre_operational` the operational state. "
              "`duplicate` and `reorder` do so with frames, `short_pdo` sends frames a byte short. "
              "`refuse` refuses an object, `slow` is slow, `lie` lies about the position. `ignore` does not "
              "follow its setpoints, `quiet_fault` faults without an emergency message. `held` holds the "
              "axis fast, `sto` takes its torque, `inputs` sets the bits of 0x60FD to the value. Devices: "
              "`silent`, `short` answers by halves, `slow`, `lie`, `good` again.",
              "", "one of the words on the right"},
             {"value",
              "How much. It is the code of an emergency or fault, the object that is refused, or counts "
              "that a drive lies by. Of a heartbeat or answer it is the us by which it is late. Of a "
              "device it is ms, or what is added to its registers. 0 ends what lasts.",
              "", "any whole number; of a device -32768 to 32767"},
         }},
        {"Learnt friction of a stage",
         {{"X", ""}, {"Y", ""}},
         "The file that `[corrections.deflection] networks` names. `trunnion micromill train` writes it; a "
         "file that was "
         "changed by hand is refused.",
         {
             {"delays", "Taps of the delay line behind the first."},
             {"spacing_periods", "Periods from tap to tap."},
             {"standing_mm", "An axis that travels less from tap to tap counts as standing."},
             {"layers", "Hidden layers."},
             {"nodes", "Nodes of each layer."},
             {"position_scale_mm", "What the position is divided by."},
             {"travel_scale_mm", "What the travel from tap to tap is divided by."},
             {"force_scale_N", "What the output is multiplied by."},
             {"checksum", "Checksum of shape and weights."},
             {"weights", "Layer by layer, each matrix column by column, then its bias.", "",
              "as many as the shape has"},
         }},
        {"How it was learnt",
         {{"X.record", ""}, {"Y.record", ""}},
         "",
         {
             {"method", "How the weights were found."},
             {"data", "From which runs."},
             {"samples", "Number of samples."},
             {"iterations", "Steps of the training."},
             {"starts", "Number of random starts, of which the best was kept."},
             {"rms_training_N", "What is left of the force in the runs that were learnt from."},
             {"explained_training", "Share of the variance that is explained there."},
             {"rms_validation_N", "What is left in runs that were not learnt from."},
             {"explained_validation", "Share of the variance that is explained there."},
             {"innovation_rms_mm",
              "Innovation of the load filter in the training runs, which `innovation_alarm` "
              "multiplies."},
         }},
    }};

}  // namespace trn
