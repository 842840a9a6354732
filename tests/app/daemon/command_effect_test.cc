#include "app/daemon/command_effect.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trn {
namespace {

using trunnion::command_t;

// No verb may fall to an event or a setting that acts: each one's is written a second time here.
TEST(CommandEffect, EveryVerbAsksTheSupervisorForItsOwnEvent) {
  EXPECT_EQ(effect_of(command_t::LOAD).event, Event::kLoad);
  EXPECT_EQ(effect_of(command_t::START).event, Event::kStart);
  EXPECT_EQ(effect_of(command_t::HOLD).event, Event::kHold);
  EXPECT_EQ(effect_of(command_t::RESUME).event, Event::kResume);
  EXPECT_EQ(effect_of(command_t::STOP).event, Event::kStop);
  EXPECT_EQ(effect_of(command_t::MDI).event, Event::kMdi);
  EXPECT_EQ(effect_of(command_t::JOG).event, Event::kJog);
  EXPECT_EQ(effect_of(command_t::HOME).event, Event::kHome);
  EXPECT_EQ(effect_of(command_t::ESTOP).event, Event::kEstop);
  EXPECT_EQ(effect_of(command_t::RESET).event, Event::kReset);
  for (const auto verb :
       {command_t::OVERRIDE, command_t::CORRECTION, command_t::RAPID_OVERRIDE, command_t::SPINDLE_OVERRIDE,
        command_t::ADAPTIVE_FEED, command_t::SINGLE_BLOCK, command_t::OPTIONAL_STOP, command_t::BLOCK_DELETE,
        command_t::ACKNOWLEDGE, command_t::PARTS, command_t::DRY_RUN, command_t::MACHINE_LOCK,
        command_t::DELETE_TOOL})
    EXPECT_FALSE(effect_of(verb).event);
}

TEST(CommandEffect, EverySettingIsToldToTheTickByItsOwnCommand) {
  using Kind = RtCommand::Kind;
  EXPECT_EQ(effect_of(command_t::OVERRIDE).setting, Kind::kOverride);
  EXPECT_EQ(effect_of(command_t::RAPID_OVERRIDE).setting, Kind::kRapidOverride);
  EXPECT_EQ(effect_of(command_t::SPINDLE_OVERRIDE).setting, Kind::kSpindleOverride);
  EXPECT_EQ(effect_of(command_t::ADAPTIVE_FEED).setting, Kind::kAdaptiveFeed);
  EXPECT_EQ(effect_of(command_t::SINGLE_BLOCK).setting, Kind::kSingleBlock);
  for (const auto verb :
       {command_t::LOAD, command_t::START, command_t::HOLD, command_t::RESUME, command_t::STOP,
        command_t::MDI, command_t::JOG, command_t::HOME, command_t::ESTOP, command_t::RESET,
        command_t::CORRECTION, command_t::OPTIONAL_STOP, command_t::BLOCK_DELETE, command_t::ACKNOWLEDGE,
        command_t::PARTS, command_t::DRY_RUN, command_t::MACHINE_LOCK, command_t::DELETE_TOOL})
    EXPECT_FALSE(effect_of(verb).setting);
}

TEST(CommandEffect, ValuesOutOfAnyRangeAreNamed) {
  const auto bad = [](auto change) {
    command_t command{};
    command.verb = command_t::JOG;
    change(command);
    return bad_values(command, 3);
  };
  EXPECT_EQ(bad([](command_t&) {}), "");
  EXPECT_EQ(bad([](command_t& c) { c.alive_ms = 20, c.speed_share = 1, c.joint = 2; }), "");
  EXPECT_EQ(bad([](command_t& c) { c.verb = command_t::HOME, c.joint = -1; }), "");
  EXPECT_NE(bad([](command_t& c) { c.verb = 0; }), "");
  EXPECT_NE(bad([](command_t& c) { c.joint = 3; }), "");
  EXPECT_NE(bad([](command_t& c) { c.joint = -1; }), "");
  EXPECT_NE(bad([](command_t& c) { c.speed = -1; }), "");
  EXPECT_NE(bad([](command_t& c) { c.value = std::nan(""); }), "");
  EXPECT_NE(bad([](command_t& c) { c.speed_share = 1.01; }), "");
  EXPECT_NE(bad([](command_t& c) { c.speed_share = std::nan(""); }), "");
  for (const int alive_ms : {-1, 1, 19, 1001})
    EXPECT_NE(bad([&](command_t& c) { c.alive_ms = alive_ms; }), "") << alive_ms;
  EXPECT_NE(bad([](command_t& c) { c.verb = command_t::START, c.alive_ms = 100; }), "");
}

}  // namespace
}  // namespace trn
