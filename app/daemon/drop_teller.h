#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace trn {

/// Tells, once a minute at most, how many packets of clients were no messages and were dropped.
class DropTeller {
 public:
  /// `dropped` counts from the daemon's start. What is to be told now; "" if there is nothing new, or if a
  /// minute has not passed since it last told.
  std::string look(std::uint64_t dropped, std::chrono::steady_clock::time_point now);

 private:
  std::uint64_t told_ = 0;
  std::chrono::steady_clock::time_point quiet_until_;
};

}  // namespace trn
