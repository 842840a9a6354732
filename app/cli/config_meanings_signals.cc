#include "app/cli/config_meanings.h"

namespace trn {

const ChapterMeaning kSignalMeanings = {
    "Wiring of signals",
    "An output, or an input that programs read, follows an input or a state of the machine. For example, a "
    "lamp that "
    "is on while a program runs. `trunnion io --svg` draws it.",
    {
        {"",
         {{"signal", ""}},
         "",
         {
             {"name", "What messages and the drawing call it. Each name is there once."},
             {"from", "Where it comes from.", "",
              "\"io.input.3\"; \"drive.X.input.16\" (bit 16 of 0x60FD); or \"machine.enabled\", "
              "\"machine.moving\", \"machine.running\" (a program), \"machine.fault\", \"machine.homed\", "
              "\"machine.spindle\", \"machine.mist\", \"machine.flood\""},
             {"to",
              "Where it goes. No program switches this output any more, and no other signal ends there.", "",
              "\"io.output.4\"; \"drive.Z.output.1\" (bit 1 of 0x60FE); \"io.input.20\", an input that M66 "
              "reads"},
             {"invert", "Whether it is on when its source is off."},
             {"debounce_s", "A change of the source counts when it has lasted for longer."},
             {"delay_s", "It goes on so much later, and off at once."},
         }},
    }};

}  // namespace trn
