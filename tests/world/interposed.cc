// The calls of the C library in which threads meet, take time or talk: here they ask the scheduler, as long
// as the calling thread is one of its world; else they are what they always were. What the linker finds in a
// program goes before what it finds in a library, so that the product needs no change.

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <random>

#include "tests/world/disk.h"
#include "tests/world/scheduler.h"

namespace {

using trn::world::Disk;
using trn::world::kMillisecond;
using trn::world::kNever;
using trn::world::kSecond;
using trn::world::raw_call;
using trn::world::Scheduler;

constexpr std::int64_t kUnixNs = 1'800'000'000 * kSecond;  // where the world's calendar begins

template <typename Function>
Function real(const char* name, const char* version = nullptr) {
  void* const found = version ? dlvsym(RTLD_NEXT, name, version) : dlsym(RTLD_NEXT, name);
  return reinterpret_cast<Function>(found);
}

long as_errno(long result) {
  if (result >= 0) return result;
  errno = static_cast<int>(-result);
  return -1;
}

template <typename Pointer>
long word(Pointer* pointer) {
  return reinterpret_cast<long>(pointer);
}

std::int64_t ns_of(const timespec& time) { return time.tv_sec * kSecond + time.tv_nsec; }

std::int64_t deadline_of(clockid_t clock, const timespec& time) {
  return ns_of(time) - (clock == CLOCK_REALTIME ? kUnixNs : 0);
}

// The mutex's own memory says who has it, so that one that was never locked needs nothing.
bool try_lock(Scheduler& scheduler, pthread_mutex_t* mutex) {
  auto& data = mutex->__data;
  const int self = scheduler.self().number + 1;
  if (data.__owner == self && (data.__kind & 3) == PTHREAD_MUTEX_RECURSIVE) {
    ++data.__count;
    return true;
  }
  if (data.__owner != 0) return false;
  data.__owner = self;
  data.__count = 1;
  return true;
}

void lock(Scheduler& scheduler, pthread_mutex_t* mutex) {
  while (!try_lock(scheduler, mutex)) scheduler.wait(mutex, kNever, "pthread_mutex_lock");
}

void unlock(Scheduler& scheduler, pthread_mutex_t* mutex) {
  auto& data = mutex->__data;
  if (--data.__count != 0) return;
  data.__owner = 0;
  scheduler.wake_all(mutex);
}

int wait_condition(Scheduler& scheduler, pthread_cond_t* condition, pthread_mutex_t* mutex,
                   std::int64_t deadline) {
  unlock(scheduler, mutex);
  bool woken = true;
  if (scheduler.spurious())
    scheduler.pass("pthread_cond_wait");
  else
    woken = scheduler.wait(condition, deadline, "pthread_cond_wait");
  lock(scheduler, mutex);
  return woken ? 0 : ETIMEDOUT;
}

long futex(Scheduler& scheduler, int* address, int operation, int value, const timespec* time) {
  const int what = operation & FUTEX_CMD_MASK;
  if (what == FUTEX_WAKE || what == FUTEX_WAKE_BITSET) {
    scheduler.wake_all(address);
    scheduler.pass("futex");
    return 1;
  }
  if (__atomic_load_n(address, __ATOMIC_ACQUIRE) != value) return -EAGAIN;
  std::int64_t deadline = kNever;
  const clockid_t clock = operation & FUTEX_CLOCK_REALTIME ? CLOCK_REALTIME : CLOCK_MONOTONIC;
  if (time && what == FUTEX_WAIT) deadline = scheduler.now_ns() + ns_of(*time);
  if (time && what == FUTEX_WAIT_BITSET) deadline = deadline_of(clock, *time);
  return scheduler.wait(address, deadline, "futex") ? 0 : -ETIMEDOUT;
}

}  // namespace

// A client's number is drawn with it.
std::random_device::result_type std::random_device::_M_getval() {
  static std::mt19937 numbers(20'26);
  return static_cast<std::random_device::result_type>(numbers());
}

#pragma GCC visibility push(default)  // the C++ library shall find them, too
extern "C" {

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* given) {
  Scheduler* const scheduler = Scheduler::current();
  static const auto call = real<decltype(&pthread_create)>("pthread_create");
  return scheduler ? scheduler->create(thread, attributes, run, given) : call(thread, attributes, run, given);
}

int pthread_join(pthread_t thread, void** result) {
  static const auto call = real<decltype(&pthread_join)>("pthread_join");
  Scheduler* const scheduler = Scheduler::current();
  return scheduler ? scheduler->join(thread, result) : call(thread, result);
}

int pthread_setname_np(pthread_t thread, const char* name) {
  if (Scheduler* const scheduler = Scheduler::current()) scheduler->name_thread(thread, name);
  return 0;
}

// Which thread runs is the scheduler's choice alone.
int pthread_setschedparam(pthread_t, int, const sched_param*) { return 0; }
int pthread_setaffinity_np(pthread_t, size_t, const cpu_set_t*) { return 0; }

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static const auto call = real<decltype(&pthread_mutex_lock)>("pthread_mutex_lock");
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(mutex);
  scheduler->pass("pthread_mutex_lock");
  lock(*scheduler, mutex);
  return 0;
}

int pthread_mutex_trylock(pthread_mutex_t* mutex) {
  static const auto call = real<decltype(&pthread_mutex_trylock)>("pthread_mutex_trylock");
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(mutex);
  return try_lock(*scheduler, mutex) ? 0 : EBUSY;
}

int pthread_mutex_unlock(pthread_mutex_t* mutex) {
  static const auto call = real<decltype(&pthread_mutex_unlock)>("pthread_mutex_unlock");
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(mutex);
  unlock(*scheduler, mutex);
  scheduler->pass("pthread_mutex_unlock");
  return 0;
}

int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  static const auto call = real<decltype(&pthread_cond_wait)>("pthread_cond_wait", "GLIBC_2.3.2");
  Scheduler* const scheduler = Scheduler::current();
  return scheduler ? wait_condition(*scheduler, condition, mutex, kNever) : call(condition, mutex);
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* time) {
  static const auto call = real<decltype(&pthread_cond_timedwait)>("pthread_cond_timedwait", "GLIBC_2.3.2");
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(condition, mutex, time);
  return wait_condition(*scheduler, condition, mutex, deadline_of(CLOCK_REALTIME, *time));
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* time) {
  static const auto call = real<decltype(&pthread_cond_clockwait)>("pthread_cond_clockwait");
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(condition, mutex, clock, time);
  return wait_condition(*scheduler, condition, mutex, deadline_of(clock, *time));
}

int pthread_cond_signal(pthread_cond_t* condition) {
  static const auto call = real<decltype(&pthread_cond_signal)>("pthread_cond_signal", "GLIBC_2.3.2");
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(condition);
  scheduler->wake_one(condition);
  scheduler->pass("pthread_cond_signal");
  return 0;
}

int pthread_cond_broadcast(pthread_cond_t* condition) {
  static const auto call = real<decltype(&pthread_cond_broadcast)>("pthread_cond_broadcast", "GLIBC_2.3.2");
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(condition);
  scheduler->wake_all(condition);
  scheduler->pass("pthread_cond_broadcast");
  return 0;
}

int pthread_once(pthread_once_t* once, void (*run)(void)) {
  static const auto call = real<decltype(&pthread_once)>("pthread_once");
  constexpr int kBegun = 1, kDone = 2;  // as in the C library, which may have finished it before
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return call(once, run);
  while (*once == kBegun) scheduler->wait(once, kNever, "pthread_once");
  if (*once == kDone) return 0;
  *once = kBegun;
  run();
  *once = kDone;
  scheduler->wake_all(once);
  return 0;
}

long syscall(long number, ...) {
  va_list list;
  va_start(list, number);
  long given[6];
  for (long& value : given) value = va_arg(list, long);
  va_end(list);
  Scheduler* const scheduler = Scheduler::current();
  if (scheduler && number == SYS_futex)
    return as_errno(futex(*scheduler, reinterpret_cast<int*>(given[0]), static_cast<int>(given[1]),
                          static_cast<int>(given[2]), reinterpret_cast<const timespec*>(given[3])));
  return as_errno(raw_call(number, given[0], given[1], given[2], given[3], given[4], given[5]));
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return static_cast<int>(as_errno(raw_call(SYS_clock_gettime, clock, word(time))));
  scheduler->pass("clock_gettime");
  const bool calendar = clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE;
  const std::int64_t now = scheduler->look_at_clock() + (calendar ? kUnixNs : 0);
  *time = {now / kSecond, now % kSecond};
  return 0;
}

time_t time(time_t* to) noexcept {
  timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (to) *to = now.tv_sec;
  return now.tv_sec;
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* wanted, timespec* left) {
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler)
    return static_cast<int>(-raw_call(SYS_clock_nanosleep, clock, flags, word(wanted), word(left)));
  const bool absolute = flags & TIMER_ABSTIME;
  scheduler->sleep_until(absolute ? deadline_of(clock, *wanted) : scheduler->now_ns() + ns_of(*wanted),
                         "clock_nanosleep");
  return 0;
}

int nanosleep(const timespec* wanted, timespec* left) {
  const int error = clock_nanosleep(CLOCK_MONOTONIC, 0, wanted, left);
  if (error != 0) errno = error;
  return error == 0 ? 0 : -1;
}

int sched_yield() noexcept {
  Scheduler* const scheduler = Scheduler::current();
  if (!scheduler) return static_cast<int>(as_errno(raw_call(SYS_sched_yield)));
  scheduler->look_at_clock();
  scheduler->pass("sched_yield");
  return 0;
}

int poll(pollfd* what, nfds_t count, int timeout_ms) {
  Scheduler* const scheduler = Scheduler::current();
  const auto look = [&](int patience_ms) {
    return static_cast<int>(as_errno(raw_call(SYS_poll, word(what), static_cast<long>(count), patience_ms)));
  };
  if (!scheduler) return look(timeout_ms);
  const std::int64_t deadline = timeout_ms < 0 ? kNever : scheduler->now_ns() + timeout_ms * kMillisecond;
  scheduler->pass("poll");
  while (true) {
    const int found = look(0);
    if (found != 0 || timeout_ms == 0 || scheduler->now_ns() >= deadline) return found;
    scheduler->wait_for_io(deadline, "poll");
  }
}

// Where the other side does not read, the thread waits in the world's time.
ssize_t send(int socket, const void* bytes, size_t size, int flags) {
  Scheduler* const scheduler = Scheduler::current();
  const auto go = [&](int how) {
    return as_errno(raw_call(SYS_sendto, socket, word(bytes), static_cast<long>(size), how, 0, 0));
  };
  if (!scheduler) return go(flags);
  scheduler->pass("send");
  while (true) {
    const long sent = go(flags | MSG_DONTWAIT);
    if (sent >= 0) scheduler->io_happened();
    if (sent >= 0 || errno != EAGAIN || (flags & MSG_DONTWAIT)) return sent;
    scheduler->sleep_until(scheduler->now_ns() + kMillisecond, "send");
  }
}

int connect(int socket, const sockaddr* address, socklen_t size) {
  const int outcome = static_cast<int>(as_errno(raw_call(SYS_connect, socket, word(address), size)));
  const int error = errno;
  if (Scheduler* const scheduler = Scheduler::current()) {
    scheduler->io_happened();
    scheduler->pass("connect");
  }
  errno = error;
  return outcome;
}

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const int mode = va_arg(list, int);
  va_end(list);
  Disk* const disk = Scheduler::current() ? Disk::of(path) : nullptr;
  if (disk && (flags & O_ACCMODE) != O_RDONLY)
    if (const int error = disk->trouble("open")) return static_cast<int>(as_errno(-error));
  const int fd = static_cast<int>(as_errno(raw_call(SYS_open, word(path), flags, mode)));
  if (disk && fd >= 0) disk->opened(path, fd, flags);
  return fd;
}

ssize_t write(int fd, const void* bytes, size_t size) {
  Disk* const disk = Scheduler::current() ? Disk::of(fd) : nullptr;
  if (!disk) return as_errno(raw_call(SYS_write, fd, word(bytes), static_cast<long>(size)));
  if (const int error = disk->trouble("write")) return as_errno(-error);
  const long done = as_errno(raw_call(SYS_write, fd, word(bytes), static_cast<long>(disk->share_of(size))));
  disk->written(fd);
  return done;
}

int fsync(int fd) {
  Disk* const disk = Scheduler::current() ? Disk::of(fd) : nullptr;
  if (!disk) return static_cast<int>(as_errno(raw_call(SYS_fsync, fd)));
  if (const int error = disk->trouble("fsync")) return static_cast<int>(as_errno(-error));
  disk->synced(fd);
  return 0;
}

int rename(const char* from, const char* to) noexcept {
  Disk* const disk = Scheduler::current() ? Disk::of(to) : nullptr;
  if (disk)
    if (const int error = disk->trouble("rename")) return static_cast<int>(as_errno(-error));
  const int outcome = static_cast<int>(as_errno(raw_call(SYS_rename, word(from), word(to))));
  if (disk && outcome == 0) disk->renamed(from, to);
  return outcome;
}

int unlink(const char* path) noexcept {
  const int outcome = static_cast<int>(as_errno(raw_call(SYS_unlink, word(path))));
  Disk* const disk = Scheduler::current() ? Disk::of(path) : nullptr;
  if (disk && outcome == 0) disk->unlinked(path);
  return outcome;
}

int close(int fd) {
  if (Disk* const disk = Disk::of(fd)) disk->closed(fd);
  const int outcome = static_cast<int>(as_errno(raw_call(SYS_close, fd)));
  if (Scheduler* const scheduler = Scheduler::current()) scheduler->io_happened();
  return outcome;
}

}  // extern "C"
#pragma GCC visibility pop
