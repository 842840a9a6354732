#include "app/cli/config_meanings.h"

namespace trn {

const ChapterMeaning kDrawingMeanings = {
    "Drawings of the machine",
    "The panel draws every machine by its axes. With drawings of its own it looks as it stands in the shop. "
    "For "
    "example, one body for the bed and one for each axis. Export each body from the assembly with every "
    "joint at "
    "zero (of a hexapod or rail mill: every word). Its coordinates are those of the machine's base frame, in "
    "mm.",
    {
        {"",
         {{"drawing", ""}},
         "",
         {
             {"part", "What the body moves with.", "",
              "\"base\" (it stands), \"table\", \"spindle\", or a joint of a machine with a chain of axes"},
             {"stl",
              "An STL file, text or binary, at most 64 MB. A relative path begins at the config's folder."},
         }},
    }};

}  // namespace trn
