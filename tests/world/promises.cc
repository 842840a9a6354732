#include "tests/world/promises.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/world/scheduler.h"

#ifdef TRN_COUNTS_LINES
extern "C" void __gcov_dump();
#endif

namespace trn::world {

namespace {

struct State {
  std::uint64_t seed = 0, digest = 14695981039346656037u;
  bool verbose = false;
  int result_fd = -1;
  std::string folder, process;
};
State* g_state = nullptr;

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
}

void tell(const std::string& text) {
  std::string_view left = text;
  while (!left.empty()) {
    const ssize_t written = ::write(g_state->result_fd, left.data(), left.size());
    if (written <= 0) break;
    left.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

void Chronicle::begin(std::uint64_t seed, bool verbose, int result_fd, const std::string& folder) {
  g_state = new State;
  g_state->seed = seed;
  g_state->verbose = verbose;
  g_state->result_fd = result_fd;
  g_state->folder = folder;
  g_state->process = fmt::format("process {}", getpid());
}

double Chronicle::now_s() {
  const Scheduler* const scheduler = Scheduler::current();
  return scheduler ? static_cast<double>(scheduler->now_ns()) * 1e-9 - 1000 : 0;
}

void Chronicle::note(std::string text) {
  replace_all(text, g_state->folder, "WORLD");
  replace_all(text, g_state->process, "process P");
  const std::string line = fmt::format("{:10.6f} {}\n", now_s(), text);
  for (const char c : line) count(static_cast<unsigned char>(c));
  if (g_state->verbose) std::fputs(line.c_str(), stdout);
}

void Chronicle::count(std::uint64_t value) { g_state->digest = (g_state->digest ^ value) * 1099511628211u; }

void Chronicle::finding(std::string_view promise, const std::string& what) {
  note(fmt::format("FINDING: {}: {}", promise, what));
  std::string text = fmt::format("{} at {:.3f} s: {}", promise, now_s(), what);
  replace_all(text, g_state->folder, "WORLD");
  replace_all(text, g_state->process, "process P");
  replace_all(text, "\n", " ");
  std::fflush(nullptr);
  tell(text);
  std::_Exit(1);
}

void Chronicle::good_end() {
  std::uint64_t digest = g_state->digest;
  if (const Scheduler* const scheduler = Scheduler::current()) digest ^= scheduler->digest();
  note("the session is over, and every promise was kept");
  std::fflush(nullptr);
  tell(fmt::format("{:016x} {:.3f}", digest, now_s()));
#ifdef TRN_COUNTS_LINES
  Scheduler::end();  // the counts go to the real disk
  __gcov_dump();
#endif
  std::_Exit(0);
}

}  // namespace trn::world
