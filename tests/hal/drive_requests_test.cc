#include "hal/drive_requests.h"

#include <gtest/gtest.h>

#include <atomic>

namespace trn {
namespace {

constexpr unsigned kOn = 1, kOff = 2, kAnew = 4;

TEST(DriveRequests, ABringUpAsksOnce) {
  std::atomic<unsigned> requests = 0;
  requests.fetch_or(kAnew);
  requests.fetch_or(kComingUp);
  EXPECT_EQ(take_asked(requests), kAnew);
  EXPECT_EQ(take_asked(requests), 0u) << "it is still under way";
  ask_unless_stopped(requests, kOn);
  EXPECT_EQ(take_asked(requests), kOn);
  EXPECT_EQ(take_asked(requests), 0u);
}

TEST(DriveRequests, AQuickStopTakesItBackWheneverItComes) {
  for (const int moment : {0, 1, 2, 3}) {
    std::atomic<unsigned> requests = 0;
    const auto stop_at = [&](int now) {
      if (now == moment) take_back(requests, kOn);
    };
    stop_at(0);
    requests.fetch_or(kComingUp);
    stop_at(1);
    requests.fetch_or(kOff | kAnew);
    ask_unless_stopped(requests, kOn);
    stop_at(2);
    const unsigned asked = take_asked(requests);
    stop_at(3);
    EXPECT_EQ(asked & kOn, moment == 1 || moment == 2 ? 0u : kOn) << moment;
    EXPECT_EQ(asked & ~kOn, kOff | kAnew) << "what is off stays off";
    EXPECT_EQ(take_asked(requests), 0u);
    ask_unless_stopped(requests, kOn);
    EXPECT_EQ(take_asked(requests), 0u) << "no bring-up is under way";
    requests.fetch_or(kComingUp);
    ask_unless_stopped(requests, kOn);
    EXPECT_EQ(take_asked(requests), kOn) << "the next one comes up";
  }
}

}  // namespace
}  // namespace trn
