#pragma once

#include <pthread.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace trn::world {

inline constexpr std::int64_t kNever = INT64_MAX;
inline constexpr std::int64_t kMicrosecond = 1'000, kMillisecond = 1'000'000, kSecond = 1'000'000'000;

/// How unkind the scheduler is; all of it is drawn from the seed.
struct Malice {
  double switch_share = 0.1;      ///< of the calls that may pass the baton on, those that do
  double hold_share = 0;          ///< of the same calls, those behind which the thread is held for a while
  std::int64_t hold_ns = 0;       ///< at most
  std::int64_t tick_hold_ns = 0;  ///< the same for the thread `tick`
  double spurious_share = 0;      ///< of the waits on condition variables, those that end for no reason
};

/// What a thread of the world is at.
struct WorldThread {
  enum class State : std::uint8_t { kReady, kRunning, kBlocked, kFinished };
  int number = 0;
  std::string name;
  State state = State::kReady;
  std::int64_t wake_ns = kNever;    ///< virtual; when it goes on by itself
  const void* waits_for = nullptr;  ///< an address that another thread must name
  const char* call = "";            ///< that it is in, for people
  bool woken = false;               ///< by another thread, not by the clock
  bool waits_for_io = false;
  std::int64_t held_until_ns = 0;  ///< by the scheduler's malice
  int turn = 0;                    ///< futex: 1 when it has the baton
  pthread_t handle{};
  bool detached = false;
};

/// One baton for all threads of a process: whoever has it runs, and every call that is interposed
/// (interposed.cc) is a point where a seeded choice may pass it on. Time is virtual: it stands while anybody
/// can run, but for a little at every look at the clock, and jumps to the next wake-up when nobody can. The
/// same seed gives the same order.
class Scheduler {
 public:
  /// The calling thread becomes the first one, and has the baton. `fail` hears why nothing can go on any
  /// more, with the baton, and does not return.
  static void begin(std::uint64_t seed, const Malice& malice, std::function<void(const std::string&)> fail);
  /// Threads are their own again; only one may be left.
  static void end();
  /// Null while the calling thread is not scheduled.
  static Scheduler* current();

  std::int64_t now_ns() const { return now_ns_; }
  /// A look at the clock takes its time.
  std::int64_t look_at_clock();
  /// No thread sees a later time.
  void set_end(std::int64_t end_ns) { end_ns_ = end_ns; }
  /// How long the threads that carry a command (all but the planners) have been held so far, together.
  std::int64_t held_ns() const;
  /// Of every decision so far.
  std::uint64_t digest() const { return digest_; }
  std::uint64_t switches() const { return switches_; }

  /// A point where the baton may be passed on.
  void pass(const char* call);
  void sleep_until(std::int64_t wake_ns, const char* call);
  /// Until another thread names `what`; false if `deadline_ns` came first.
  bool wait(const void* what, std::int64_t deadline_ns, const char* call);
  void wake_all(const void* what);
  void wake_one(const void* what);
  /// Until something was sent, connected or closed; false if the deadline came first.
  bool wait_for_io(std::int64_t deadline_ns, const char* call);
  void io_happened();
  bool spurious();

  int create(pthread_t* handle, const pthread_attr_t* attributes, void* (*run)(void*), void* given);
  int join(pthread_t handle, void** result);
  void name_thread(pthread_t handle, const std::string& name);
  const WorldThread& self() const;

 private:
  struct Launch;
  static void* launch(void* given);
  WorldThread* find(pthread_t handle);
  void schedule();
  WorldThread* choose();
  [[noreturn]] void stuck();
  bool chance(double share);
  std::int64_t draw(std::int64_t most);

  std::mt19937_64 random_;
  Malice malice_;
  std::function<void(const std::string&)> fail_;
  std::vector<std::unique_ptr<WorldThread>> threads_;
  std::int64_t now_ns_ = 1000 * kSecond, end_ns_ = kNever, held_ns_ = 0;
  std::uint64_t digest_ = 14695981039346656037u, switches_ = 0;
};

/// The operating system's own calls, for those who must not be scheduled.
long raw_call(long number, long a = 0, long b = 0, long c = 0, long d = 0, long e = 0, long f = 0);

}  // namespace trn::world
