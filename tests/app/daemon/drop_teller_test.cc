#include "app/daemon/drop_teller.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

namespace trn {
namespace {

using std::chrono::seconds;

// A flood of nonsense is one line a minute in the journal, and no packet is missing in the sum.
TEST(DropTeller, TellsOnceAMinuteWhatIsNew) {
  DropTeller teller;
  const std::chrono::steady_clock::time_point start{seconds(1000)};
  const auto number = [](const std::string& text) { return text.empty() ? 0 : std::stoi(text); };
  EXPECT_EQ(teller.look(0, start), "") << "nothing was dropped";
  EXPECT_EQ(teller.look(3, start), "3 packets of clients were no messages and were dropped") << "at once";
  for (int s = 1; s < 60; ++s)
    EXPECT_EQ(teller.look(static_cast<std::uint64_t>(3 + s), start + seconds(s)), "") << s;
  EXPECT_EQ(number(teller.look(65, start + seconds(60))), 62);
  EXPECT_EQ(teller.look(65, start + seconds(300)), "") << "nothing is new";
  EXPECT_EQ(number(teller.look(66, start + seconds(301))), 1);
}

}  // namespace
}  // namespace trn
