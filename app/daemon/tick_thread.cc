#include "app/daemon/tick_thread.h"

#include <pthread.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <future>
#include <system_error>

#include "core/check.h"

namespace trn {

TickThread::TickThread(const RealtimeConfig& config, double period_s, Tick tick) {
  std::promise<void> ready;
  std::future<void> is_ready = ready.get_future();
  const std::int64_t period_ns = std::llround(period_s * 1e9);
  TRN_CHECK(period_ns > 0);
  thread_ =
      std::thread([this, config, period_ns, tick = std::move(tick), ready = std::move(ready)]() mutable {
        pthread_setname_np(pthread_self(), "tick");
        refused_ = make_thread_realtime(config);
        ready.set_value();
        try {
          run_periodic(period_ns, statistics_, [&](int late_periods) {
            tick(late_periods, statistics_);
            return !stop_.load(std::memory_order_relaxed);
          });
        } catch (const std::system_error&) {
          failed_ = true;
        }
      });
  is_ready.wait();
}

TickThread::~TickThread() { end(); }

void TickThread::end() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

TerminationSignals::TerminationSignals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  const int error = pthread_sigmask(SIG_BLOCK, &set, nullptr);
  if (error != 0) throw std::system_error(error, std::generic_category(), "pthread_sigmask");
  fd_ = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "signalfd");
}

TerminationSignals::~TerminationSignals() { close(fd_); }

bool TerminationSignals::taken() {
  signalfd_siginfo info;
  return read(fd_, &info, sizeof info) == sizeof info;
}

}  // namespace trn
