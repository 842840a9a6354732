#pragma once

#include <array>
#include <memory>
#include <string>

#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"
#include "core/realtime.h"
#include "kernel/joint_ramp.h"

namespace trn {

/// A spindle whose drive is a joint of the machine, section [spindle_axis]. The drive follows positions all
/// the time. As a spindle its joint is told the plan's place and a turn on top that grows with the speed (M3,
/// M4); M19 leaves that turn such that the spindle stands at an angle. As an axis the turn is a whole number
/// of revolutions, so that the joint is where the plan has it. Nobody else sees the turn: it is added to the
/// setpoints behind the plan and taken from the feedback. It is the spindle of the machine's I/O as well,
/// with an encoder, and hands all else on to the devices beside the drives.
class SpindleAxis final : public MachineIo {
 public:
  struct Config {
    int joint = -1;
    Joint limits;       ///< of this joint: an endless one
    double sense = -1;  ///< 1: M3 (clockwise) turns it positively; -1: negatively
    double period_s = 0;
    int feedback_periods = 0;  ///< as Drives::feedback_periods
  };
  /// Of the joint's velocity: a change of speed that ends there does not shoot over it.
  static constexpr double kSpeedShare = 0.99;

  /// `devices` may be null.
  SpindleAxis(const Config& config, std::unique_ptr<MachineIo> devices);

  /// In front of the drives' exchange. `forward`: the velocity offset is told to the drives.
  void turn(Setpoints& setpoints, bool forward) TRN_RT;
  /// And behind it.
  void turn_back(Feedback& feedback) TRN_RT;

  void bring_up() override;
  void shut_down() noexcept override;
  void exchange(const IoOutputs& outputs, const IoPlace& place, IoInputs& inputs) TRN_RT override;
  std::string explain_fault() const override;
  std::string health() const override;

  double speed_rad_s() const TRN_RT { return speed_; }
  double turn_rad() const TRN_RT { return turn_; }

 private:
  void step() TRN_RT;
  void change_speed(double wanted) TRN_RT;
  void set_out() TRN_RT;
  void lose(bool homes) TRN_RT;
  double angle_wanted() const TRN_RT;

  const Config config_;
  std::unique_ptr<MachineIo> devices_;
  JointRamp ramp_;
  double wanted_rad_s_ = 0;
  bool orients_ = false;  ///< M19, or an axis: it stands at `told_deg_`
  double told_deg_ = 0;
  bool reached_ = false;  ///< that angle
  bool going_ = false;    ///< on `ramp_`, to `goal_deg_`
  double goal_deg_ = 0;
  bool placed_ = true;                   ///< `turn_` is what an angle has left
  double speed_ = 0, acceleration_ = 0;  ///< off the ramp; rad/s, rad/s2
  double last_acceleration_ = 0;
  double turn_ = 0;                 ///< on top of the plan, rad
  double plan_ = 0, measured_ = 0;  ///< of the joint, in the last period; rad
  bool obeyed_ = false;
  static constexpr std::size_t kPast = 8;
  std::array<double, kPast> past_{};  ///< the turn, by period
  std::size_t period_ = 0;
};

}  // namespace trn
