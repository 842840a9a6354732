#include "app/cli/config_meanings.h"

namespace trn {

const ChapterMeaning kSafetyMeanings = {
    "Safety wiring",
    "What tells the control of the hardware's safety circuit, and which brakes it operates. It protects "
    "nobody: "
    "[safety.md](safety.md) says what does.",
    {
        {"A safety input",
         {{"safety.input", ""}},
         "Each kind has one fault, and with it one reaction: [faults.md](faults.md).",
         {
             {"kind",
              "`emergency_stop` and `enable` are watched while the drives are on. `door` is watched while "
              "something moves or the spindle turns, `air` while something moves."},
             {"from", "Where it is wired.", "",
              "an input, as \"drive.X.input.16\" (bit 16 of 0x60FD) or \"io.input.3\""},
             {"safe_when",
              "`on`: a broken wire is not safe; `off`: the input is on when something is wrong."},
             {"debounce_s", "A change counts when it has lasted for longer."},
             {"jog", "Of a `door`: whether the operator may jog while it is open."},
         }},
        {"A holding brake",
         {{"safety.brake", ""}},
         "The drive holds the axis before the brake lets go, and lets go when the brake holds. Only drives "
         "with "
         "`type = \"canopen\"` know brakes.",
         {
             {"joint", "The joint that it holds.", "", "the name of a joint"},
             {"output", "What releases it.", "",
              "an output, as \"drive.Z.output.0\" (bit 0 of 0x60FE of its own drive) or \"io.output.4\""},
             {"released_by", "`on`: it closes without power."},
             {"release_s", "From the output until the axis is free."},
             {"close_s", "From the output until the brake holds; longer is safer."},
         }},
    }};

}  // namespace trn
