#pragma once

#include <cstdint>
#include <random>

#include "app/check/limit_judge.h"
#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/simulated_drives.h"

namespace trn::world {

/// What goes wrong with the drives of a session.
struct DriveMalice {
  double fault_share = 0;  ///< of the periods, those in which something happens to a joint
};

/// The drives of a machine, with the judge at their door: every setpoint that is sent is judged in the period
/// in which it is sent, and so is how long the drives take to be told to stop, and to stand.
class WatchedDrives final : public Drives {
 public:
  WatchedDrives(SimulatedDrives& inner, const Machine& machine, const DriveMalice& malice,
                std::uint64_t seed);

  void bring_up() override { inner_.bring_up(); }
  void shut_down() noexcept override;
  void reset_faults() override { inner_.reset_faults(); }
  std::string explain_fault(int joint) const override { return inner_.explain_fault(joint); }
  std::string health() const override { return inner_.health(); }
  bool real() const override { return false; }
  void exchange(const Setpoints& setpoints, Feedback& feedback) noexcept override;
  void request_home(unsigned joint_mask) noexcept override { inner_.request_home(joint_mask); }
  void quick_stop() noexcept override;

  /// Somebody has commanded an emergency stop; `held_ns`: how long the threads between him and the drives
  /// have been held so far.
  void expect_stop();
  std::uint64_t periods() const { return period_; }
  /// No more faults from now on.
  void calm_down() { malice_.fault_share = 0; }

 private:
  void do_harm();
  void judge(const Setpoints& setpoints, bool enabled);
  void judge_stop(const Feedback& feedback);
  void judge_rest(const Feedback& feedback);

  SimulatedDrives& inner_;
  const Machine& machine_;
  DriveMalice malice_;
  std::mt19937_64 random_;
  LimitJudge judge_;
  std::uint64_t period_ = 0, obeyed_ = 0, lost_until_ = 0, stuck_until_ = 0;
  std::int64_t stop_due_ns_ = 0, stop_held_ns_ = 0;  ///< 0: none is due
  std::uint64_t stopped_at_ = 0;                     ///< period of the quick stop that is not over; 0: none
  bool was_enabled_ = false;
  JointVec q_last_;
};

}  // namespace trn::world
