#pragma once

// What specimens say of motors besides their drives: feed-forward, safety, several motors of one joint.
namespace trn {

inline constexpr char kTorques[] = R"(
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

inline constexpr char kSafety[] = R"(
[[safety.input]]
kind = "door"
from = "drive.@X.input.16"
[[safety.brake]]
joint = "@Z"
output = "drive.@Z.output.0"
release_s = 0.1
close_s = 0.1
)";

inline constexpr char kMotors[] = R"(
[[drives.emulation.motor]]
node = "can0:6"
inputs_on = [16]
[[drives.emulation.motor]]
node = "can0:7"
)";

}  // namespace trn
