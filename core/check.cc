#include "core/check.h"

#include <cstdio>
#include <cstdlib>

namespace trn {

namespace {
// One a thread: the tick's failures are not the planner's.
// It lies where the thread begins, also in the shared library: no call in the tick to find it.
[[gnu::tls_model("initial-exec")]] thread_local CheckFailure* note_here = nullptr;
}  // namespace

std::string explain(const CheckFailure& failure) {
  if (!failure) return "";
  return std::string(failure.file) + ":" + std::to_string(failure.line) + ": the internal check (" +
         failure.condition + ") failed";
}

// Scopes may lie within each other; at the end of the inner one the note of the outer one is in force again.
CheckScope::CheckScope(CheckFailure& into) TRN_RT : before_(note_here) { note_here = &into; }

CheckScope::~CheckScope() { note_here = before_; }

void check_failed(const char* file, int line, const char* condition) TRN_RT {
  if (note_here) {
    // The first failure is told. What fails behind it works with values that are wrong already.
    if (!*note_here) *note_here = {file, line, condition};
    return;
  }
  // Outside of the tick and the planner nobody takes the note. The process ends, and the drives stop because
  // they hear nothing any more.
  std::fprintf(stderr, "%s:%d: internal check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace trn
