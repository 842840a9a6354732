#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace trn::world {

/// The log of a session, with virtual times, and its findings. One a process.
class Chronicle {
 public:
  static void begin(std::uint64_t seed, bool verbose, int result_fd, const std::string& folder);
  /// A line of the log; what differs from run to run (process, folder) is left out of it.
  static void note(std::string text);
  /// Counts towards the digest, and is not shown.
  static void count(std::uint64_t value);
  /// A promise was broken: one line, and the process ends.
  [[noreturn]] static void finding(std::string_view promise, const std::string& what);
  /// All is well: the digest goes to whoever waits for it, and the process ends.
  [[noreturn]] static void good_end();
  static double now_s();
};

}  // namespace trn::world
