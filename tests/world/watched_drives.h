#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "app/check/limit_judge.h"
#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"
#include "tests/world/harm.h"

namespace trn::world {

/// The drives of a machine, with the judge at their door: every setpoint that is sent is judged in the period
/// in which it is sent, and so is how long the drives take to be told to stop, and to stand.
class WatchedDrives final : public Drives {
 public:
  WatchedDrives(Drives& inner, const Machine& machine, Harm& harm);

  void bring_up() override;
  void shut_down() noexcept override;
  void reset_faults() override { inner_.reset_faults(); }
  std::string explain_fault(int joint) const override { return inner_.explain_fault(joint); }
  std::string health() const override { return inner_.health(); }
  bool real() const override { return inner_.real(); }
  void exchange(const Setpoints& setpoints, Feedback& feedback) noexcept override;
  void request_home(unsigned joint_mask) noexcept override { inner_.request_home(joint_mask); }
  void quick_stop() noexcept override;

  /// Somebody has commanded an emergency stop; `held_ns`: how long the threads between him and the drives
  /// have been held so far.
  void expect_stop();
  /// No more faults from now on.
  void calm_down() { harm_.calm_down(); }

 private:
  void bring_up_if_asked();
  void judge_row(std::uint64_t period, const JointVec& q);
  JointVec standing_at(const JointVec& first) const;
  Joints joints_around(const JointVec& q) const;
  void judge(const Setpoints& setpoints, bool enabled);
  void judge_stop(const Feedback& feedback);
  void judge_rest(const Feedback& feedback);
  void judge_fall(DriveState state);
  void judge_power(DriveState state);

  Drives& inner_;
  const Machine& machine_;
  Harm& harm_;
  LimitJudge judge_;
  std::uint64_t period_ = 0, obeyed_ = 0;
  std::int64_t stop_due_ns_ = 0, stop_held_ns_ = 0;  ///< 0: none is due
  std::uint64_t stopped_at_ = 0;                     ///< period of the quick stop that is not over; 0: none
  std::atomic<int> since_stop_ = -1;  ///< periods since a quick stop behind which nobody has brought them up
  bool was_enabled_ = false;
  JointVec q_last_, q_before_;                  ///< as the drives told it in the last two periods
  JointVec place_last_;                         ///< as it is
  std::uint64_t brake_periods_;                 ///< within which a joint must come to rest
  std::atomic<bool> asked_ = false;             ///< to bring up the drives, in the tick's thread
  std::string refusal_;                         ///< why that failed
  bool stands_ = false;                         ///< every axis, as it is
  JointVec stood_;                              ///< at the last bring-up, as it was
  int since_bring_up_ = 1000, since_harm_ = 0;  ///< periods
};

}  // namespace trn::world
