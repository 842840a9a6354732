#include "app/daemon/command_gate.h"

#include <gtest/gtest.h>

// Buckets of commands on a clock that the test sets.
namespace trn {
namespace {

using namespace std::chrono_literals;
constexpr CommandGate::Clock::time_point kBegin{std::chrono::hours(1)};

int admitted(CommandGate& gate, const CommandGate::Sender& sender, int commands,
             CommandGate::Clock::time_point now) {
  int count = 0;
  for (int i = 0; i < commands; ++i) count += gate.admit(sender, now) ? 1 : 0;
  return count;
}

TEST(CommandGate, ASenderHasItsBurstAndThenItsRate) {
  CommandGate gate;
  EXPECT_EQ(admitted(gate, {1, 1}, 1000, kBegin), 100);
  EXPECT_EQ(admitted(gate, {1, 1}, 1000, kBegin + 100ms), 20) << "200 a second";
  EXPECT_EQ(admitted(gate, {1, 1}, 1000, kBegin + 10s), 100) << "never more than a burst";
}

TEST(CommandGate, ALoudSenderKeepsNobodyOut) {
  CommandGate gate;
  admitted(gate, {1, 1}, 1000, kBegin);
  EXPECT_EQ(admitted(gate, {1, 2}, 1000, kBegin), 100) << "another process";
  EXPECT_EQ(admitted(gate, {2, 1}, 1000, kBegin), 100) << "another user";
}

TEST(CommandGate, AllTogetherHaveABurstAndARateToo) {
  CommandGate gate;
  int together = 0;
  for (pid_t process = 1; process <= 20; ++process) together += admitted(gate, {1, process}, 100, kBegin);
  EXPECT_EQ(together, 500);
  together = 0;
  for (pid_t process = 101; process <= 120; ++process)
    together += admitted(gate, {1, process}, 100, kBegin + 250ms);
  EXPECT_EQ(together, 250) << "1000 a second";
}

// Who is forgotten begins with a full burst again; who was heard last is not forgotten.
TEST(CommandGate, OfTooManySendersTheOneThatWasSilentLongestIsForgotten) {
  CommandGate gate;
  EXPECT_EQ(admitted(gate, {1, 1}, 101, kBegin), 100);
  for (pid_t process = 2; process <= static_cast<pid_t>(CommandGate::kSendersMax); ++process)
    gate.admit({1, process}, kBegin + 1ms);
  EXPECT_EQ(admitted(gate, {1, 1}, 1, kBegin + 2ms), 0) << "as many as may be known";
  gate.admit({2, 1}, kBegin + 3ms);  // forgets process 2, the first of those silent since 1 ms
  EXPECT_EQ(admitted(gate, {1, 1}, 1, kBegin + 4ms), 0) << "its bucket still is empty";
}

TEST(CommandGate, TellsOnceAMinute) {
  CommandGate gate;
  EXPECT_TRUE(gate.must_tell(kBegin));
  EXPECT_FALSE(gate.must_tell(kBegin));
  EXPECT_FALSE(gate.must_tell(kBegin + 60s - 1ns));
  EXPECT_TRUE(gate.must_tell(kBegin + 60s));
  EXPECT_FALSE(gate.must_tell(kBegin + 61s));
}

}  // namespace
}  // namespace trn
