#include "core/check.h"

#include <cstdio>
#include <cstdlib>

namespace trn {

namespace {
// One a thread: the tick's failures are not the planner's.
thread_local CheckFailure* note = nullptr;
}  // namespace

std::string explain(const CheckFailure& failure) {
  if (!failure) return "";
  return std::string(failure.file) + ":" + std::to_string(failure.line) + ": the internal check (" +
         failure.condition + ") failed";
}

CheckScope::CheckScope(CheckFailure& into) TRN_RT : before_(note) { note = &into; }

CheckScope::~CheckScope() { note = before_; }

void check_failed(const char* file, int line, const char* condition) TRN_RT {
  if (note) {
    if (!*note) *note = {file, line, condition};
    return;
  }
  std::fprintf(stderr, "%s:%d: internal check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace trn
