#include "app/daemon/command_table.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trn {
namespace {

using trunnion::command_t;

TEST(CommandTable, EveryVerbHasARowAndNothingElseHas) {
  for (int verb = -128; verb <= 127; ++verb) {
    const CommandRow* row = find_command(static_cast<std::int8_t>(verb));
    ASSERT_EQ(row != nullptr, verb >= command_t::LOAD && verb <= command_t::MACHINE_LOCK) << verb;
    if (!row) continue;
    EXPECT_EQ(row->verb, verb);
  }
}

// No verb may fall to an event that acts: each one's is written a second time here.
TEST(CommandTable, EveryVerbAsksTheSupervisorForItsOwnEvent) {
  EXPECT_EQ(find_command(command_t::LOAD)->event, Event::kLoad);
  EXPECT_EQ(find_command(command_t::START)->event, Event::kStart);
  EXPECT_EQ(find_command(command_t::HOLD)->event, Event::kHold);
  EXPECT_EQ(find_command(command_t::RESUME)->event, Event::kResume);
  EXPECT_EQ(find_command(command_t::STOP)->event, Event::kStop);
  EXPECT_EQ(find_command(command_t::MDI)->event, Event::kMdi);
  EXPECT_EQ(find_command(command_t::JOG)->event, Event::kJog);
  EXPECT_EQ(find_command(command_t::HOME)->event, Event::kHome);
  EXPECT_EQ(find_command(command_t::ESTOP)->event, Event::kEstop);
  EXPECT_EQ(find_command(command_t::RESET)->event, Event::kReset);
  for (const auto verb :
       {command_t::OVERRIDE, command_t::CORRECTION, command_t::RAPID_OVERRIDE, command_t::SPINDLE_OVERRIDE,
        command_t::ADAPTIVE_FEED, command_t::SINGLE_BLOCK, command_t::OPTIONAL_STOP, command_t::BLOCK_DELETE,
        command_t::ACKNOWLEDGE, command_t::PARTS, command_t::DRY_RUN, command_t::MACHINE_LOCK})
    EXPECT_FALSE(find_command(verb)->event);
}

TEST(CommandTable, ValuesOutOfAnyRangeAreNamed) {
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
