#include "app/daemon/switches.h"

#include <gtest/gtest.h>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

using trunnion::command_t;

command_t switch_command(std::int8_t verb, bool on, const std::string& name = "") {
  command_t command{};
  command.verb = verb;
  command.value = on ? 1 : 0;
  command.text = name;
  return command;
}

TEST(Switches, TheOptionalStopIsTheTicksAndActsAtAnyTime) {
  for (const bool on : {true, false}) {
    const SwitchOrder order =
        plan_switch(switch_command(command_t::OPTIONAL_STOP, on), {0, true, !on}, false, nullptr, nullptr);
    EXPECT_EQ(order.refusal, "");
    ASSERT_TRUE(order.command);
    EXPECT_EQ(order.command->kind, RtCommand::Kind::kOptionalStop);
    EXPECT_EQ(order.command->value != 0, on);
    EXPECT_EQ(order.programs, (ProgramSwitches{0, true, on}));
    EXPECT_FALSE(order.changes_plan);
  }
}

TEST(Switches, BlockDeleteIsPartOfThePlan) {
  const command_t on = switch_command(command_t::BLOCK_DELETE, true);
  const SwitchOrder order = plan_switch(on, {3, false, true}, true, nullptr, nullptr);
  EXPECT_EQ(order.refusal, "");
  EXPECT_TRUE(order.changes_plan);
  EXPECT_FALSE(order.command);
  EXPECT_EQ(order.programs, (ProgramSwitches{3, true, true}));
  const SwitchOrder live = plan_switch(on, {}, false, nullptr, nullptr);
  EXPECT_EQ(live.refusal, "");
  EXPECT_TRUE(live.changes_reading) << "of a program that is under way, what is not read yet";
  EXPECT_FALSE(live.changes_plan);
}

TEST(Switches, CorrectionsOfThePlanKeepTheOthersAsTheyAre) {
  const Assembly measured = assemble(source_dir() + "/configs/cradle_measured.toml");
  const auto plan = [&](const std::string& name, bool on, ProgramSwitches now) {
    return plan_switch(switch_command(command_t::CORRECTION, on, name), now, true, measured.map.get(),
                       nullptr);
  };
  EXPECT_EQ(plan("geometric", false, {kJointTableBit, true, false}).programs,
            (ProgramSwitches{kJointTableBit | kGeometricBit, true, false}));
  EXPECT_EQ(plan("geometric", true, {kJointTableBit | kGeometricBit, true, false}).programs,
            (ProgramSwitches{kJointTableBit, true, false}));
  EXPECT_NE(plan("luck", true, {}).refusal.find("has no correction 'luck'"), std::string::npos);
}

}  // namespace
}  // namespace trn
