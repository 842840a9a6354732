#include "interp/gcode/work_frame.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

TEST(WorkFrame, OffsetsAddAndReachTheRotaryWords) {
  WorkFrame frame;
  frame.g5x = {{10, 20, 30}, {1, 2, 3}};
  frame.g92 = {{0.5, 0, 0}, {0, 0, 4}};
  EXPECT_EQ(frame.to_machine({{1, 1, 1}, {5, 5, 5}}), (MachineWords{{11.5, 21, 31}, {6, 7, 12}}));
}

// A quarter turn takes X to Y. G92 acts along the turned axes, G54 along those of the machine.
TEST(WorkFrame, TheTurnIsAboutTheOriginOfTheWorkOffset) {
  WorkFrame frame;
  frame.g5x.xyz = {100, 0, 0};
  frame.g92.xyz = {1, 0, 0};
  frame.rotation_deg = 90;
  const MachineWords machine = frame.to_machine({{2, 0, 5}, Vec3::Zero()});
  EXPECT_LT((machine.xyz - Vec3(100, 3, 5)).norm(), 1e-12);
}

TEST(WorkFrame, BackIsTheInverseOfThere) {
  WorkFrame frame;
  frame.g5x = {{10, -20, 30}, {1, 2, 3}};
  frame.g92 = {{-4, 5, 6}, {7, 8, 9}};
  const MmWords place{{1, 2, 3}, {4, 5, 6}};
  for (const bool tilted : {false, true})
    for (const double turn_deg : {0.0, 33.0}) {
      frame.rotation_deg = turn_deg;
      frame.tilted = tilted;
      frame.origin = {3, 1, 4};
      frame.R_tilt = rot_x(0.3) * rot_z(1.1);
      const MmWords back = frame.to_program(frame.to_machine(place));
      EXPECT_LT((back.xyz - place.xyz).norm() + (back.abc_deg - place.abc_deg).norm(), 1e-12);
    }
}

}  // namespace
}  // namespace trn
