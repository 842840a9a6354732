#include "tests/world/scheduler.h"

#include <dlfcn.h>
#include <linux/futex.h>
#include <sys/syscall.h>

#include <algorithm>
#include <climits>
#include <utility>

namespace trn::world {

namespace {

constexpr std::int64_t kLookNs = 200;  // a look at the clock

// One world a process. Plain pointers: nothing may be constructed when the first call comes.
Scheduler* g_scheduler = nullptr;
thread_local WorldThread* t_self = nullptr;

void wait_for_turn(WorldThread& thread) {
  while (__atomic_load_n(&thread.turn, __ATOMIC_ACQUIRE) == 0)
    raw_call(SYS_futex, reinterpret_cast<long>(&thread.turn), FUTEX_WAIT_PRIVATE, 0);
  __atomic_store_n(&thread.turn, 0, __ATOMIC_RELAXED);
}

void give_turn(WorldThread& thread) {
  __atomic_store_n(&thread.turn, 1, __ATOMIC_RELEASE);
  raw_call(SYS_futex, reinterpret_cast<long>(&thread.turn), FUTEX_WAKE_PRIVATE, 1);
}

}  // namespace

long raw_call(long number, long a, long b, long c, long d, long e, long f) {
#ifdef __x86_64__
  register long r10 asm("r10") = d;
  register long r8 asm("r8") = e;
  register long r9 asm("r9") = f;
  long result = number;
  asm volatile("syscall"
               : "+a"(result)
               : "D"(a), "S"(b), "d"(c), "r"(r10), "r"(r8), "r"(r9)
               : "rcx", "r11", "memory");
  return result;
#else
#error "the simulated world knows the system calls of x86-64 only"
#endif
}

struct Scheduler::Launch {
  WorldThread* thread;
  void* (*run)(void*);
  void* given;
};

void Scheduler::begin(std::uint64_t seed, const Malice& malice,
                      std::function<void(const std::string&)> fail) {
  auto* made = new Scheduler;
  made->random_.seed(seed);
  made->malice_ = malice;
  made->fail_ = std::move(fail);
  made->threads_.push_back(std::make_unique<WorldThread>());
  made->threads_[0]->name = "main";
  made->threads_[0]->state = WorldThread::State::kRunning;
  made->threads_[0]->handle = pthread_self();
  t_self = made->threads_[0].get();
  g_scheduler = made;
}

void Scheduler::end() {
  t_self = nullptr;
  delete std::exchange(g_scheduler, nullptr);
}

Scheduler* Scheduler::current() { return t_self ? g_scheduler : nullptr; }

const WorldThread& Scheduler::self() const { return *t_self; }

bool Scheduler::chance(double share) {
  return share > 0 && static_cast<double>(random_() >> 11) * 0x1p-53 < share;
}

std::int64_t Scheduler::draw(std::int64_t most) {
  return most <= 0 ? 0 : static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(most)) + 1;
}

std::int64_t Scheduler::look_at_clock() { return now_ns_ += kLookNs; }

bool Scheduler::spurious() { return chance(malice_.spurious_share); }

void Scheduler::pass(const char* call) {
  const bool is_tick = t_self->name == "tick";
  if (chance(malice_.hold_share)) {
    const std::int64_t hold_ns = draw(is_tick ? malice_.tick_hold_ns : malice_.hold_ns);
    if (t_self->name.find("planner") == std::string::npos) {
      held_ns_ += hold_ns;
      t_self->held_until_ns = now_ns_ + hold_ns;
    }
    return sleep_until(now_ns_ + hold_ns, call);
  }
  if (!chance(malice_.switch_share)) return;
  t_self->call = call;
  t_self->state = WorldThread::State::kReady;
  schedule();
}

// What is still to come of a hold is not over.
std::int64_t Scheduler::held_ns() const {
  std::int64_t sum = held_ns_;
  for (const auto& thread : threads_) sum -= std::max<std::int64_t>(0, thread->held_until_ns - now_ns_);
  return sum;
}

void Scheduler::sleep_until(std::int64_t wake_ns, const char* call) { wait(nullptr, wake_ns, call); }

bool Scheduler::wait(const void* what, std::int64_t deadline_ns, const char* call) {
  t_self->call = call;
  t_self->waits_for = what;
  t_self->wake_ns = deadline_ns;
  t_self->woken = false;
  t_self->state = WorldThread::State::kBlocked;
  schedule();
  return t_self->woken;
}

bool Scheduler::wait_for_io(std::int64_t deadline_ns, const char* call) {
  t_self->waits_for_io = true;
  return wait(nullptr, deadline_ns, call);
}

namespace {
void make_ready(WorldThread& thread) {
  thread.woken = true;
  thread.state = WorldThread::State::kReady;
}
}  // namespace

void Scheduler::wake_all(const void* what) {
  for (const auto& thread : threads_)
    if (thread->state == WorldThread::State::kBlocked && thread->waits_for == what) make_ready(*thread);
}

void Scheduler::wake_one(const void* what) {
  std::vector<WorldThread*> waiting;
  for (const auto& thread : threads_)
    if (thread->state == WorldThread::State::kBlocked && thread->waits_for == what)
      waiting.push_back(thread.get());
  if (!waiting.empty()) make_ready(*waiting[random_() % waiting.size()]);
}

void Scheduler::io_happened() {
  for (const auto& thread : threads_)
    if (thread->state == WorldThread::State::kBlocked && thread->waits_for_io) make_ready(*thread);
}

// Who can run now; where nobody can, time goes on to the next wake-up.
WorldThread* Scheduler::choose() {
  std::int64_t next_ns = kNever;
  bool any = false;
  for (const auto& thread : threads_) {
    any = any || thread->state == WorldThread::State::kReady;
    if (thread->state == WorldThread::State::kBlocked) next_ns = std::min(next_ns, thread->wake_ns);
  }
  if (!any && next_ns == kNever) return nullptr;
  if (!any) now_ns_ = std::max(now_ns_, next_ns);
  std::vector<WorldThread*> ready;
  for (const auto& thread : threads_) {
    if (thread->state == WorldThread::State::kBlocked && thread->wake_ns <= now_ns_)
      thread->state = WorldThread::State::kReady;
    if (thread->state == WorldThread::State::kReady) ready.push_back(thread.get());
  }
  return ready[random_() % ready.size()];
}

void Scheduler::schedule() {
  WorldThread* const self = t_self;
  WorldThread* const next = choose();
  if (!next) stuck();
  if (now_ns_ > end_ns_) {
    end_ns_ = kNever;
    fail_("the session does not end");
  }
  for (const std::uint64_t part :
       {static_cast<std::uint64_t>(next->number), static_cast<std::uint64_t>(now_ns_)})
    digest_ = (digest_ ^ part) * 1099511628211u;
  ++switches_;
  next->state = WorldThread::State::kRunning;
  next->wake_ns = kNever;
  next->waits_for = nullptr;
  next->waits_for_io = false;
  if (next == self) return;
  give_turn(*next);
  if (self->state != WorldThread::State::kFinished) wait_for_turn(*self);
}

void Scheduler::stuck() {
  std::string text = "deadlock:";
  for (const auto& thread : threads_)
    if (thread->state != WorldThread::State::kFinished)
      text += " " + thread->name + " in " + thread->call + ",";
  text.back() = ';';
  fail_(text + " nobody can go on");
  __builtin_trap();
}

WorldThread* Scheduler::find(pthread_t handle) {
  for (auto thread = threads_.rbegin(); thread != threads_.rend(); ++thread)
    if (pthread_equal((*thread)->handle, handle)) return thread->get();
  return nullptr;
}

void* Scheduler::launch(void* given) {
  const Launch launch = *static_cast<Launch*>(given);
  wait_for_turn(*launch.thread);
  delete static_cast<Launch*>(given);
  t_self = launch.thread;
  void* const result = launch.run(launch.given);
  launch.thread->state = WorldThread::State::kFinished;
  g_scheduler->wake_all(launch.thread);
  Scheduler* const scheduler = g_scheduler;
  scheduler->schedule();
  t_self = nullptr;
  return result;
}

int Scheduler::create(pthread_t* handle, const pthread_attr_t* attributes, void* (*run)(void*), void* given) {
  static const auto real = reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  auto thread = std::make_unique<WorldThread>();
  thread->number = static_cast<int>(threads_.size());
  thread->name = "thread " + std::to_string(thread->number);
  const int error = real(handle, attributes, &Scheduler::launch, new Launch{thread.get(), run, given});
  if (error != 0) return error;
  thread->handle = *handle;
  threads_.push_back(std::move(thread));
  pass("pthread_create");
  return 0;
}

int Scheduler::join(pthread_t handle, void** result) {
  static const auto real = reinterpret_cast<decltype(&pthread_join)>(dlsym(RTLD_NEXT, "pthread_join"));
  WorldThread* const thread = find(handle);
  while (thread && thread->state != WorldThread::State::kFinished) wait(thread, kNever, "pthread_join");
  if (thread) thread->handle = {};
  return real(handle, result);
}

void Scheduler::name_thread(pthread_t handle, const std::string& name) {
  if (WorldThread* const thread = find(handle)) thread->name = name;
}

}  // namespace trn::world
