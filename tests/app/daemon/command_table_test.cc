#include "app/daemon/command_table.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

using trunnion::command_t;

TEST(CommandTable, EveryVerbHasARowAndNothingElseHas) {
  for (int verb = -128; verb <= 127; ++verb) {
    const CommandRow* row = find_command(static_cast<std::int8_t>(verb));
    ASSERT_EQ(row != nullptr, verb >= command_t::LOAD && verb <= command_t::SINGLE_BLOCK) << verb;
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
  for (const auto verb : {command_t::OVERRIDE, command_t::CORRECTION, command_t::RAPID_OVERRIDE,
                          command_t::SPINDLE_OVERRIDE, command_t::ADAPTIVE_FEED, command_t::SINGLE_BLOCK})
    EXPECT_FALSE(find_command(verb)->event);
}

}  // namespace
}  // namespace trn
