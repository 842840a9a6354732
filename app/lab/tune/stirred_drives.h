#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/axes.h"
#include "core/ports.h"

namespace trn {

/// The drives of a machine, one of which is told a torque that changes its sign at random from period to
/// period, beside all else that it is told. The sequence is the same every time.
class StirredDrives final : public Drives {
 public:
  explicit StirredDrives(std::unique_ptr<Drives> inner) : inner_(std::move(inner)) {}

  /// `force`: N or Nm; 0: no more.
  void stir(int joint, double force) {
    joint_ = joint;
    force_ = force;
    told_ = 0;
  }
  double told() const { return told_; }  ///< in the last period

  void bring_up() override { inner_->bring_up(); }
  void shut_down() noexcept override { inner_->shut_down(); }
  void reset_faults() override { inner_->reset_faults(); }
  std::string explain_fault(int joint) const override { return inner_->explain_fault(joint); }
  std::string health() const override { return inner_->health(); }
  std::vector<std::string> warnings() const override { return inner_->warnings(); }
  int feedback_periods() const override { return inner_->feedback_periods(); }
  bool real() const override { return inner_->real(); }
  void request_home(unsigned joint_mask) TRN_RT override { inner_->request_home(joint_mask); }
  void quick_stop() TRN_RT override { inner_->quick_stop(); }
  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override {
    if (force_ == 0) return inner_->exchange(setpoints, feedback);
    // A register with feedback by its bits 16, 14, 13 and 11 comes back after 65535 steps.
    const unsigned bit = (register_ ^ register_ >> 2 ^ register_ >> 3 ^ register_ >> 5) & 1u;
    register_ = static_cast<std::uint16_t>(register_ >> 1 | bit << 15);
    told_ = bit != 0 ? force_ : -force_;
    Setpoints stirred = setpoints;
    if (stirred.force_offset.size() == 0) stirred.force_offset = JointVec::Zero(setpoints.q.size());
    stirred.force_offset[joint_] += told_;
    inner_->exchange(stirred, feedback);
  }

 private:
  std::unique_ptr<Drives> inner_;
  int joint_ = 0;
  double force_ = 0, told_ = 0;
  std::uint16_t register_ = 0xACE1;
};

}  // namespace trn
