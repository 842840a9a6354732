#include "app/daemon/tick_thread.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include "app/daemon/realtime.h"
#include "app/session/realtime_config.h"

namespace trn {
namespace {

RealtimeConfig without_rights() {
  RealtimeConfig config;
  config.priority = 0;
  config.cpu = -1;
  return config;
}

// Fifty periods of a millisecond cannot be over in less than that.
TEST(TickThread, TicksOnceAPeriodFromItsOwnThread) {
  constexpr std::uint64_t kTicks = 50;
  std::atomic<std::uint64_t> ticks = 0;
  std::atomic<bool> other_thread = false;
  const auto begin = std::chrono::steady_clock::now();
  auto thread = std::make_unique<TickThread>(
      without_rights(), 0.001, [&, owner = std::this_thread::get_id()](int, const LoopStatistics&) {
        other_thread = std::this_thread::get_id() != owner;
        ++ticks;
      });
  while (ticks < kTicks) std::this_thread::yield();
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(took, std::chrono::milliseconds(kTicks));
  EXPECT_TRUE(other_thread);
  EXPECT_TRUE(thread->refused().empty()) << thread->refused().front();
  EXPECT_FALSE(thread->failed());
  const std::uint64_t seen = ticks;
  while (ticks == seen) std::this_thread::yield();
  thread.reset();
  const std::uint64_t last = ticks;
  std::this_thread::yield();
  EXPECT_EQ(ticks, last) << "none behind its end";
}

// A tick may be late, but hardly every one of a hundred: the least lateness of the first hundred and of the
// next ones is that of one clock. Were the period another one, each tick would add the difference.
TEST(TickThread, KeepsThePeriodThatItIsGiven) {
  using std::chrono::steady_clock;
  constexpr int kHalf = 100;
  const auto begin = steady_clock::now();
  double least_s[2] = {1e9, 1e9};
  int ticks = 0, periods = 0;
  std::atomic<bool> done = false;
  {
    const TickThread thread(without_rights(), 0.001, [&](int late_periods, const LoopStatistics&) {
      if (done) return;
      periods += 1 + late_periods;
      const double now_s = std::chrono::duration<double>(steady_clock::now() - begin).count();
      double& least = least_s[ticks / kHalf];
      least = std::min(least, now_s - 0.001 * periods);
      done = ++ticks == 2 * kHalf;
    });
    while (!done) std::this_thread::yield();
  }
  EXPECT_NEAR(least_s[1], least_s[0], 0.03) << "a period of 2 ms would make it 0.1 s";
}

TEST(TickThread, SaysWhatTheKernelRefusedBeforeItReturns) {
  RealtimeConfig config = without_rights();
  config.cpu = CPU_SETSIZE - 1;  // no host has so many
  const TickThread thread(config, 0.001, [](int, const LoopStatistics&) {});
  ASSERT_EQ(thread.refused().size(), 1u);
  EXPECT_NE(thread.refused()[0].find("not bound to processor " + std::to_string(CPU_SETSIZE - 1)),
            std::string::npos)
      << thread.refused()[0];
}

// As where the clock refuses: nobody ticks any more, and the owner is told.
TEST(TickThread, SaysThatTheClockFailed) {
  std::atomic<int> ticks = 0;
  const TickThread thread(without_rights(), 0.001, [&](int, const LoopStatistics&) {
    if (++ticks == 3) throw std::system_error(EINVAL, std::generic_category(), "clock_nanosleep");
  });
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!thread.failed() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  EXPECT_TRUE(thread.failed());
  EXPECT_EQ(ticks, 3);
}

TEST(TerminationSignals, AreTakenOnceEachInsteadOfEndingTheProcess) {
  sigset_t before;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  {
    TerminationSignals signals;
    EXPECT_FALSE(signals.taken());
    for (const int signal : {SIGTERM, SIGINT}) {
      raise(signal);  // this thread's own: others may not block it
      EXPECT_TRUE(signals.taken()) << signal;
      EXPECT_FALSE(signals.taken()) << signal;
    }
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace
}  // namespace trn
