#include "app/client/command_rights.h"

#include <gtest/gtest.h>

#include <set>

namespace trn {
namespace {

using trunnion::command_t;

TEST(CommandRights, EveryVerbHasARowAndNothingElseHas) {
  std::set<std::string_view> names;
  for (int verb = -128; verb <= 127; ++verb) {
    const CommandRights* rights = find_rights(static_cast<std::int8_t>(verb));
    ASSERT_EQ(rights != nullptr, verb >= command_t::LOAD && verb <= command_t::MACHINE_LOCK) << verb;
    if (!rights) continue;
    EXPECT_EQ(rights->verb, verb);
    EXPECT_TRUE(names.insert(rights->name).second) << rights->name;
  }
}

TEST(CommandRights, WhatMakesTheMachineSaferIsKnown) {
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
TEST(CommandRights, EachCommandNeedsItsRole) {
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
