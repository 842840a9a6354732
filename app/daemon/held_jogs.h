#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "core/axes.h"

namespace trn {

/// The dead man of jogs: whoever holds a button says so again and again, and where that ends, the joint
/// stops.
class HeldJogs {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// In place of a joint: what moves several joints.
  static constexpr int kDirection = kMaxJoints;
  static constexpr const char* kLegal = "a jog takes 20 to 1000, or 0";

  HeldJogs() { until_.fill(Time::max()); }

  static bool legal(std::int32_t alive_ms) { return alive_ms >= 20 && alive_ms <= 1000; }
  /// A jog of this joint was asked for; `alive` 0: nobody holds it.
  void hear(int joint, std::chrono::milliseconds alive, Time now);
  /// A joint whose client has been silent for too long; each is told once.
  std::optional<int> take_silent(Time now);

 private:
  std::array<Time, kDirection + 1> until_;
};

}  // namespace trn
