#pragma once

#include <cstdint>

#include "core/realtime.h"

namespace trn {

/// What hangs on an axis without counterweight: it falls when neither the drive nor the holding brake holds
/// it. Pure; mm or rad, s.
class HangingLoad {
 public:
  struct Config {
    int falls = 0;                                         ///< -1, +1: the way; 0: it does not
    double gravity = 9810;                                 ///< mm/s^2 or rad/s^2
    std::uint32_t release_periods = 0, close_periods = 0;  ///< from the brake's output to the brake
    double period_s = 0.001;
  };
  explicit HangingLoad(const Config& config) : config_(config) {}

  bool hangs() const TRN_RT { return config_.falls != 0; }
  void set_brake(bool released) TRN_RT { released_ = released; }
  /// Once a period.
  void step() TRN_RT {
    periods_ = released_ == open_ ? 0 : periods_ + 1;
    if (periods_ <= (released_ ? config_.release_periods : config_.close_periods)) return;
    open_ = released_;
    periods_ = 0;
  }
  bool braked() const TRN_RT { return !open_; }
  /// Speed that it gains in a period.
  double gain() const TRN_RT { return config_.falls * config_.gravity * config_.period_s; }

 private:
  Config config_;
  bool released_ = false, open_ = false;
  std::uint32_t periods_ = 0;  ///< for which the output has said otherwise
};

}  // namespace trn
