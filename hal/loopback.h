#pragma once

#include "core/axes.h"
#include "core/ports.h"

namespace trn {

/// The simplest drives: every joint stands at the setpoint of the same period. They come up at once, know
/// their position and never fault.
class LoopbackDrives final : public Drives {
 public:
  /// `q_start`: position until the first setpoint, mm or rad.
  explicit LoopbackDrives(const JointVec& q_start) : q_(q_start) {}

  void bring_up() override { state_ = DriveState::kEnabled; }
  void shut_down() noexcept override { state_ = DriveState::kOff; }
  bool real() const override { return false; }
  void reset_faults() override {}

  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override;
  void request_home(unsigned) TRN_RT override {}
  void quick_stop() TRN_RT override { state_ = DriveState::kOff; }

 private:
  JointVec q_;
  DriveState state_ = DriveState::kOff;
};

}  // namespace trn
