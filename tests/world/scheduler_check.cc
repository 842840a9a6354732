#include "tests/world/scheduler_check.h"

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/world/scheduler.h"

namespace trn::world {

namespace {

using std::chrono::milliseconds;

struct Outcome {
  std::string order;
  std::uint64_t digest = 0;
  std::int64_t took_ns = 0;
};

Malice unkind() {
  Malice malice;
  malice.switch_share = 0.5;
  malice.hold_share = 0.02;
  malice.hold_ns = 3 * kMillisecond;
  malice.spurious_share = 0.2;
  return malice;
}

// Three makers and a taker over one queue; the makers sleep as well.
Outcome run_threads(std::uint64_t seed) {
  Scheduler::begin(seed, unkind(), [](const std::string&) { std::_Exit(9); });
  const std::int64_t begin_ns = Scheduler::current()->now_ns();
  Outcome outcome;
  std::mutex mutex;
  std::condition_variable filled;
  std::deque<char> queue;
  std::vector<std::thread> makers;
  for (const char name : {'a', 'b', 'c'})
    makers.emplace_back([&, name] {
      for (int i = 0; i < 20; ++i) {
        if (i % 5 == 4) std::this_thread::sleep_for(milliseconds(2));
        const std::lock_guard held(mutex);
        queue.push_back(name);
        filled.notify_one();
      }
    });
  for (int i = 0; i < 60; ++i) {
    std::unique_lock held(mutex);
    filled.wait(held, [&] { return !queue.empty(); });
    outcome.order += queue.front();
    queue.pop_front();
  }
  for (std::thread& maker : makers) maker.join();
  std::promise<int> promise;
  std::thread teller([&] { promise.set_value(7); });
  if (promise.get_future().get() != 7) outcome.order += '!';
  teller.join();
  outcome.digest = Scheduler::current()->digest();
  outcome.took_ns = Scheduler::current()->now_ns() - begin_ns;
  Scheduler::end();
  return outcome;
}

constexpr int kDeadlockSeen = 3, kNoDeadlock = 4;

// Two locks, taken in two orders: some seeds must run into each other.
[[noreturn]] void cross_locks(std::uint64_t seed) {
  Scheduler::begin(seed, unkind(), [](const std::string& what) {
    std::_Exit(what.starts_with("deadlock") ? kDeadlockSeen : 9);
  });
  std::mutex one, other;
  std::thread thread([&] {
    const std::lock_guard first(one);
    const std::lock_guard second(other);
  });
  {
    const std::lock_guard first(other);
    const std::lock_guard second(one);
  }
  thread.join();
  std::_Exit(kNoDeadlock);
}

std::string check_deadlocks() {
  int seen = 0, missed = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const pid_t child = fork();
    if (child == 0) cross_locks(seed);
    int status = 0;
    waitpid(child, &status, 0);
    seen += WIFEXITED(status) && WEXITSTATUS(status) == kDeadlockSeen;
    missed += WIFEXITED(status) && WEXITSTATUS(status) == kNoDeadlock;
  }
  if (seen + missed != 40) return "a session with two locks ended in another way than it may";
  if (seen == 0 || missed == 0)
    return "of 40 sessions with two locks, " + std::to_string(seen) + " locked up";
  return "";
}

std::string check_sleep() {
  Scheduler::begin(1, Malice{}, [](const std::string&) { std::_Exit(9); });
  const auto begin = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(std::chrono::hours(1));
  const auto slept = std::chrono::steady_clock::now() - begin;
  Scheduler::end();
  return slept >= std::chrono::hours(1) && slept < std::chrono::hours(1) + milliseconds(1)
             ? ""
             : "an hour of sleep took another time";
}

}  // namespace

std::string check_scheduler() {
  if (const std::string bad = check_sleep(); !bad.empty()) return bad;
  const Outcome first = run_threads(1);
  int differ = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Outcome once = run_threads(seed), again = run_threads(seed);
    if (once.order != again.order || once.digest != again.digest || once.took_ns != again.took_ns)
      return "seed " + std::to_string(seed) + " gave two orders";
    if (once.order.size() != 60) return "not all arrived";
    if (once.took_ns < 8 * kMillisecond) return "sleep took no time";
    differ += once.order != first.order;
  }
  if (differ < 15) return "seeds hardly differ";
  return check_deadlocks();
}

}  // namespace trn::world
