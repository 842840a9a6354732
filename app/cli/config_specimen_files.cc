#include "app/cli/config_specimen_texts.h"

// Of the files beside a config.
namespace trn {

const char kFaultScriptSpecimen[] = R"(
[[fault]]
at_s = 1
node = 1
kind = "silent"
[[fault]]
at_s = 1
device = "inverter"
kind = "silent"
)";

// The smallest networks that there can be.
const char kNetworksSpecimen[] = R"(
[X]
delays = 1
spacing_periods = 1
standing_mm = 0
layers = 1
nodes = 1
position_scale_mm = 1
travel_scale_mm = 1
force_scale_N = 1
checksum = "e0c36fc5"
weights = [0, 0, 0, 0, 0]
[X.record]
method = "none"
data = "none"
samples = 0
iterations = 0
starts = 0
rms_training_N = 0
explained_training = 0
rms_validation_N = 0
explained_validation = 0
innovation_rms_mm = 1
[Y]
delays = 1
spacing_periods = 1
standing_mm = 0
layers = 1
nodes = 1
position_scale_mm = 1
travel_scale_mm = 1
force_scale_N = 1
checksum = "e0c36fc5"
weights = [0, 0, 0, 0, 0]
[Y.record]
method = "none"
data = "none"
samples = 0
iterations = 0
starts = 0
rms_training_N = 0
explained_training = 0
rms_validation_N = 0
explained_validation = 0
innovation_rms_mm = 1
)";

const char kTorqueSpecimen[] = R"(
[feed_forward]
[[feed_forward.joint]]
joint = "@X"
cogging_pitch_mm = 24
cogging_N = [0, 1]
[[feed_forward.joint]]
joint = "@A"
cogging_pitch_deg = 24
cogging_Nm = [0, 1]
)";

// Of what hangs on drives.
const char kSafetySpecimen[] = R"(
[[safety.input]]
kind = "door"
from = "drive.@X.input.16"
[[drawing]]
part = "@Y"
stl = "models/saddle.stl"
[[signal]]
name = "lamp"
from = "machine.running"
to = "drive.@Y.output.1"
[[safety.brake]]
joint = "@Z"
output = "drive.@Z.output.0"
release_s = 0.1
close_s = 0.1
)";

const char kMotorSpecimen[] = R"(
[[drives.emulation.motor]]
node = "can0:6"
inputs_on = [16]
[[drives.emulation.motor]]
node = "can0:7"
)";

// Its joint would have no ends, and the machines above have all of theirs: what its own reader asks for.
const char kSpindleAxisSpecimen[] = "[spindle_axis]\n";

}  // namespace trn
