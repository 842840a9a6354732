#include "app/daemon/realtime.h"

#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <time.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace trn {

namespace {

constexpr std::int64_t kNsPerS = 1'000'000'000;

std::int64_t now_ns() {
  timespec now;
  if (clock_gettime(CLOCK_MONOTONIC, &now) != 0)
    throw std::system_error(errno, std::generic_category(), "clock_gettime");
  return now.tv_sec * kNsPerS + now.tv_nsec;
}

void sleep_until(std::int64_t deadline_ns) {
  const timespec deadline{deadline_ns / kNsPerS, deadline_ns % kNsPerS};
  int outcome = EINTR;
  while (outcome == EINTR) outcome = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
  if (outcome != 0) throw std::system_error(outcome, std::generic_category(), "clock_nanosleep");
}

// A page that is first touched in the tick costs a fault there.
void touch_stack() {
  constexpr std::size_t kStackBytes = 256 * 1024;
  volatile char stack[kStackBytes];
  for (std::size_t i = 0; i < kStackBytes; i += 1024) stack[i] = 0;
  static_cast<void>(stack[0]);
}

std::string no_priority(int priority, int error) {
  return fmt::format(
      "no real-time priority: SCHED_FIFO {} was refused ({}); the tick may be late. Run as root, or give the "
      "user "
      "'rtprio {}' in /etc/security/limits.conf (systemd: LimitRTPRIO={})",
      priority, std::strerror(error), priority, priority);
}

std::string no_processor(int cpu, int error) {
  return fmt::format("the tick is not bound to processor {} ({}); choose one of this host's in realtime.cpu",
                     cpu, std::strerror(error));
}

}  // namespace

// Left to itself the allocator learns from the first large block that is freed to keep the next ones, up to
// 32 MB.
void give_back_large_blocks() {
  constexpr int kLarge = 128 << 10;
  mallopt(M_MMAP_THRESHOLD, kLarge);
}

// Under a limit, memory that is asked for later would be refused instead of locked: then better not to lock.
std::string lock_memory() {
  constexpr std::size_t kLater = std::size_t{1} << 30;
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) {
    void* later = mmap(nullptr, kLater, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (later != MAP_FAILED && munmap(later, kLater) == 0) return "";
  }
  const int error = errno;
  munlockall();
  return fmt::format(
      "memory is not locked ({}); paging may stop the tick. Run as root, or give the user 'memlock "
      "unlimited' in "
      "/etc/security/limits.conf (systemd: LimitMEMLOCK=infinity)",
      std::strerror(error));
}

std::vector<std::string> make_thread_realtime(const RealtimeConfig& config) {
  std::vector<std::string> refused;
  if (config.cpu >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(config.cpu), &set);
    const int error = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    if (error != 0) refused.push_back(no_processor(config.cpu, error));
  }
  if (config.priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = config.priority;
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0) refused.push_back(no_priority(config.priority, error));
  }
  touch_stack();
  return refused;
}

void run_periodic(std::int64_t period_ns, LoopStatistics& statistics, const std::function<bool(int)>& tick) {
  std::int64_t deadline = now_ns() + period_ns;
  for (int late_periods = 0;;) {
    sleep_until(deadline);
    const std::int64_t begin = now_ns();
    statistics.wake_now_ns = begin - deadline;
    const bool go_on = tick(late_periods);
    const std::int64_t end = now_ns();
    statistics.tick_before_ns = end - begin;
    statistics.wake.add(begin - deadline);
    statistics.tick.add(end - begin);
    statistics.periods.fetch_add(1, std::memory_order_relaxed);
    if (!go_on) return;
    deadline += period_ns;
    late_periods = 0;
    if (end < deadline) continue;
    late_periods = static_cast<int>((end - deadline) / period_ns) + 1;
    statistics.overruns.fetch_add(static_cast<std::uint64_t>(late_periods), std::memory_order_relaxed);
    deadline += late_periods * period_ns;
  }
}

}  // namespace trn
