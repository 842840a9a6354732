#pragma once

#include <string>

#include "core/realtime.h"

// Checks that stay on in the released build: what a function requires of its caller, and what must hold
// behind it. They cost a comparison each, and a failed one is a defect of Trunnion, never a user's mistake.
//
//   TRN_CHECK(way_s >= 0);
//
// In the tick a failed check is noted and the code goes on; before anything reaches the drives, the tick sees
// the note, keeps the last setpoints, latches the fault `assertion` with file and line, and stops the drives.
// Where a program is read and planned, the program is refused with file and line. Elsewhere the process ends.
namespace trn {

/// The first check that failed. Static text, so that it may pass from thread to thread.
struct CheckFailure {
  const char* file = nullptr;  ///< null: none has failed
  int line = 0;
  const char* condition = "";
  explicit operator bool() const { return file != nullptr; }
};

/// For people, "file:line: the check ... failed"; "" if none has.
std::string explain(const CheckFailure& failure);

/// While it lives, failed checks of this thread are noted in `into`, the first one only. Scopes may nest.
class CheckScope {
 public:
  explicit CheckScope(CheckFailure& into) TRN_RT;
  ~CheckScope();
  CheckScope(const CheckScope&) = delete;
  CheckScope& operator=(const CheckScope&) = delete;

 private:
  CheckFailure* before_;
};

/// Notes the failure; without a scope, prints it and aborts.
[[gnu::cold]] void check_failed(const char* file, int line, const char* condition) TRN_RT;

}  // namespace trn

#define TRN_CHECK(condition)                                    \
  do {                                                          \
    if (!(condition)) [[unlikely]]                              \
      ::trn::check_failed(__FILE_NAME__, __LINE__, #condition); \
  } while (false)
