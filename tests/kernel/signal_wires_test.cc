#include "kernel/signal_wires.h"

#include <gtest/gtest.h>

#include <string>

namespace trn {
namespace {

using K = SignalName::Kind;

SignalWires::Wire wire(const SignalName& from, const SignalName& to) {
  SignalWires::Wire out;
  out.from = from;
  out.to = to;
  return out;
}

const SignalName kIn3{K::kIoInput, -1, 3}, kOut4{K::kIoOutput, -1, 4};

/// The end of one wire, a period a letter: '1' is an input that is on.
std::string ends_of(const SignalWires::Wire& wire, const std::string& input) {
  SignalWires wires({wire});
  const Feedback feedback;
  std::string out;
  for (const char now : input) {
    const auto& ends = wires.step({now == '1' ? 8u : 0u, &feedback, 0});
    EXPECT_EQ(ends.io_outputs.mask, 16u);
    out += ends.io_outputs.on == 16 ? '1' : '0';
  }
  return out;
}

TEST(SignalWires, FollowInvertDebounceAndDelay) {
  SignalWires::Wire plain = wire(kIn3, kOut4);
  EXPECT_EQ(ends_of(plain, "0110010"), "0110010");
  plain.invert = true;
  EXPECT_EQ(ends_of(plain, "0110010"), "1001101");
  SignalWires::Wire slow = wire(kIn3, kOut4);
  slow.debounce_periods = 2;
  EXPECT_EQ(ends_of(slow, "0101101110000"), "0000000011100") << "three alike count";
  SignalWires::Wire late = wire(kIn3, kOut4);
  late.delay_periods = 3;
  EXPECT_EQ(ends_of(late, "0111110111"), "0000110000") << "on late, off at once";
}

TEST(SignalWires, EndWhereTheyAreWiredTo) {
  const SignalName lamp{K::kDriveOutput, 2, 16}, seen{K::kIoInput, -1, 20},
      running{K::kMachine, -1, static_cast<int>(MachineSignal::kRunning)}, door{K::kDriveInput, 1, 17};
  SignalWires wires({wire(running, lamp), wire(door, seen)});
  Feedback feedback;
  feedback.inputs[1] = 1u << 17;
  const auto& on = wires.step({0, &feedback, 1u << static_cast<unsigned>(MachineSignal::kRunning)});
  EXPECT_EQ(on.drive_outputs[2], 1u << 16);
  EXPECT_EQ(on.drive_outputs[1], 0u);
  EXPECT_EQ(on.io_inputs.mask, 1u << 20);
  EXPECT_EQ(on.io_inputs.on, 1u << 20);
  feedback.inputs[1] = 0;
  const auto& off = wires.step({0, &feedback, 0});
  EXPECT_EQ(off.drive_outputs[2], 0u);
  EXPECT_EQ(off.io_inputs.on, 0u);
}

}  // namespace
}  // namespace trn
