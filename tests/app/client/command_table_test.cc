#include "app/client/command_table.h"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

namespace trn {
namespace {

using trunnion::command_t;

TEST(CommandTable, EveryVerbHasARowAndNothingElseHas) {
  std::set<std::string_view> names;
  for (int verb = -128; verb <= 127; ++verb) {
    const CommandRow* row = find_command(static_cast<std::int8_t>(verb));
    ASSERT_EQ(row != nullptr, verb >= command_t::LOAD && verb <= command_t::DELETE_TOOL) << verb;
    if (!row) continue;
    EXPECT_EQ(row->verb, verb);
    EXPECT_TRUE(names.insert(row->name).second) << row->name;
  }
}

TEST(CommandTable, ABlankOfANameMayBeAnUnderscore) {
  EXPECT_TRUE(same_name("rapid override", "rapid_override"));
  EXPECT_TRUE(same_name("rapid override", "rapid override"));
  for (const char* other :
       {"rapid-override", "rapidoverride", "rapid overridE", "rapid override ", "rapid", ""})
    EXPECT_FALSE(same_name("rapid override", other)) << other;
}

// Written a second time here, as docs/commands.md has it.
TEST(CommandTable, SettingsReachAsFarAsTheDocumentsSay) {
  EXPECT_EQ(setting_max("override"), 2);
  EXPECT_EQ(setting_max("rapid_override"), 1);
  EXPECT_EQ(setting_max("spindle_override"), 2);
  EXPECT_EQ(setting_max("adaptive_feed"), 1);
  EXPECT_EQ(setting_max("single block"), 1);
  EXPECT_EQ(setting_max("load"), 0) << "no setting";
  EXPECT_EQ(setting_max("no such command"), 0);
}

TEST(CommandTable, WhatIsSwitchedAndWhatIsNotedMovesNothing) {
  for (const auto verb : {command_t::CORRECTION, command_t::OPTIONAL_STOP, command_t::BLOCK_DELETE,
                          command_t::DRY_RUN, command_t::MACHINE_LOCK})
    EXPECT_EQ(find_command(verb)->act, CommandAct::kSwitch) << find_command(verb)->name;
  for (const auto verb : {command_t::ACKNOWLEDGE, command_t::PARTS, command_t::DELETE_TOOL})
    EXPECT_EQ(find_command(verb)->act, CommandAct::kNote) << find_command(verb)->name;
}

TEST(CommandTable, WhatMakesTheMachineSaferIsKnown) {
  for (int verb = -128; verb <= 127; ++verb) {
    command_t command{};
    command.verb = static_cast<std::int8_t>(verb);
    const bool always = verb == command_t::ESTOP || verb == command_t::STOP || verb == command_t::HOLD;
    const bool at_zero =
        verb == command_t::OVERRIDE || verb == command_t::RAPID_OVERRIDE || verb == command_t::ADAPTIVE_FEED;
    command.value = 0.1;
    EXPECT_EQ(makes_safe(command), always) << verb;
    command.value = 0;
    EXPECT_EQ(makes_safe(command), always || at_zero) << verb;
  }
}

// What stops the machine is for everybody; a correction changes how it moves; all else moves it.
TEST(CommandTable, EachCommandNeedsItsRole) {
  for (int verb = -128; verb <= 127; ++verb) {
    command_t command{};
    command.verb = static_cast<std::int8_t>(verb);
    command.value = 0.5;
    const bool stops = verb == command_t::ESTOP || verb == command_t::STOP || verb == command_t::HOLD;
    const Role moving = verb == command_t::CORRECTION ? Role::kSetUp : Role::kOperate;
    EXPECT_EQ(role_for(command), stops ? Role::kLook : moving) << verb;
  }
  command_t zero{};
  zero.verb = command_t::OVERRIDE;
  EXPECT_EQ(role_for(zero), Role::kLook);
  zero.verb = command_t::SPINDLE_OVERRIDE;
  EXPECT_EQ(role_for(zero), Role::kOperate) << "a spindle that stands in the work is not safer";
}

}  // namespace
}  // namespace trn
