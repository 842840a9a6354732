#include "kernel/cycle.h"

#include <algorithm>
#include <cmath>

#include "compensation/micromill/deflection_correction.h"

namespace trn {

namespace {
constexpr double kRounding = 1e-6;          // of a position limit and, relatively, of a step: mm, rad
constexpr PlanShares kJogShares{0.9, 0.8};  // of a jog's limits; the rest stops it at any moment
constexpr double kLowFactor = 3;  // of the plan time needed: below, what is seen may decide something
constexpr double kOverrideMax = 2;
constexpr double kJogShare = 0.1;  // of the velocity limit when a jog names no speed
}  // namespace

Cycle::Cycle(const CycleConfig& config, const JointMap& map, MotionQueue& queue, Drives& drives,
             SetpointChain* corrections)
    : config_(config),
      map_(map),
      queue_(queue),
      drives_(drives),
      commands_(256),
      reports_(config.report_capacity),
      time_scale_(config.plan_joints.empty() ? config.joints : config.plan_joints, kJogShares,
                  config.period_s),
      path_rate_(config.plan_joints.empty() ? config.joints : config.plan_joints, config.period_s),
      interpolator_(queue),
      corrections_(corrections) {
  if (config_.plan_joints.empty()) config_.plan_joints = config_.joints;
  const auto n = static_cast<Eigen::Index>(config.joints.size());
  for (JointVec* v : {&q_, &offset_, &q_sent_, &q_last_, &setpoints_.q, &setpoints_.qd, &feedback_.q})
    v->setZero(n);
  report_.q_plan = report_.q_setpoint = report_.q_measured = q_;
}

void Cycle::tick() TRN_RT {
  queue_.look();
  take_commands();
  move();
  correct_setpoints();
  check_setpoints();
  setpoints_.qd = (q_sent_ - q_last_) / config_.period_s;
  setpoints_.q = q_sent_;
  drives_.exchange(setpoints_, feedback_);
  watch_drives();
  write_report();
  q_last_ = q_sent_;
}

void Cycle::take_commands() TRN_RT {
  RtCommand command;
  for (int i = 0; i < kCommandsPerTick && commands_.try_pop(command); ++i) {
    obey(command);
    report_.last_command_id = command.id;
  }
}

void Cycle::obey(const RtCommand& command) TRN_RT {
  using Kind = RtCommand::Kind;
  const bool standing = motion_ == MotionState::kRest;
  const bool on_path = motion_ == MotionState::kMoving || motion_ == MotionState::kHeld;
  switch (command.kind) {
    case Kind::kStart:
      if (standing && fault_ == Fault::kOk) motion_ = MotionState::kMoving;
      break;
    case Kind::kHold:
      if (on_path) motion_ = MotionState::kHeld;
      break;
    case Kind::kResume:
      if (motion_ == MotionState::kPaused) interpolator_.pass_event();
      if (motion_ == MotionState::kHeld || motion_ == MotionState::kPaused) motion_ = MotionState::kMoving;
      break;
    case Kind::kStop:
      if (standing || motion_ == MotionState::kPaused) abandon_motion();
      stopping_ = motion_ != MotionState::kRest && motion_ != MotionState::kHoming;
      break;
    case Kind::kOverride:
      override_ = std::clamp(command.value, 0.0, kOverrideMax);
      break;
    case Kind::kJog:
      if (standing && fault_ == Fault::kOk) begin_jog(command);
      break;
    case Kind::kHome:
      if (standing && fault_ == Fault::kOk) begin_homing(command.joint);
      break;
    case Kind::kQuickStop:
      drives_.quick_stop();
      abandon_motion();
      break;
    case Kind::kCorrection:
      if (corrections_ && command.joint >= 0 && command.joint < corrections_->size())
        corrections_->enable(command.joint, command.value != 0);
      break;
    case Kind::kEmergencyStop:
      drives_.quick_stop();
      abandon_motion();
      latch(Fault::kEmergencyStop, -1);
      break;
    case Kind::kResetFault:
      fault_ = Fault::kOk;
      fault_joint_ = -1;
      break;
  }
}

void Cycle::begin_jog(const RtCommand& command) TRN_RT {
  const auto joint = static_cast<std::size_t>(command.joint);
  if (joint >= config_.joints.size()) return;
  const JointLimit& limit = config_.plan_joints[joint].limit;
  jog_joint_ = command.joint;
  jog_from_ = q_[command.joint];
  const double target =
      std::clamp(jog_from_ + command.value, std::min(limit.min, jog_from_), std::max(limit.max, jog_from_));
  const double speed = command.speed > 0 ? command.speed : kJogShare * limit.velocity;
  jog_ = SCurve(target - jog_from_, std::min(speed, limit.velocity),
                kJogShares.acceleration * limit.acceleration, kJogShares.jerk * limit.jerk);
  jog_time_s_ = 0;
  time_scale_.set_target(override_);
  time_scale_.restart();
  motion_ = MotionState::kJogging;
}

void Cycle::begin_homing(int joint) TRN_RT {
  const unsigned all = (1u << config_.joints.size()) - 1;
  homing_mask_ = joint < 0 ? all : (1u << joint) & all;
  homing_seen_ = 0;
  drives_.request_home(homing_mask_);
  motion_ = MotionState::kHoming;
}

void Cycle::move() TRN_RT {
  report_.event = QueueEvent{};
  report_.blocks_when_low = 0;
  if (!synchronised_)
    q_ = feedback_.q - offset_;  // drives without power: follow them, so that they start without a jump
  if (motion_ == MotionState::kRest) queue_.front();  // lets a dropped program's blocks go
  if (motion_ == MotionState::kRest || motion_ == MotionState::kPaused) return;
  if (motion_ == MotionState::kHoming) return follow_homing();
  const bool stand = stopping_ || motion_ == MotionState::kHeld;
  motion_ == MotionState::kJogging ? follow_jog(stand ? 0.0 : override_)
                                   : follow_path(stand ? 0.0 : override_);
}

bool Cycle::queue_is_short() TRN_RT {
  if (queue_.sees_stop()) return false;
  const double needed = plan_time_needed();
  if (queue_.seen_s() < kLowFactor * needed) report_.blocks_when_low = queue_.seen_number();
  return queue_.seen_s() < (waiting_ || interpolator_.at_rest() ? 2 * needed : needed);
}

void Cycle::follow_path(double target) TRN_RT {
  const bool is_short = queue_is_short();
  if (is_short && !waiting_ && !interpolator_.at_rest()) ++report_.starvations;
  waiting_ = is_short;
  if (waiting_) target = 0;
  if (interpolator_.at_rest()) path_rate_.restart(target);
  const double plan_time_s = path_rate_.step(queue_, interpolator_.place(), target);
  drive(plan_time_s);
  if (stopping_ && (path_rate_.standing() || interpolator_.at_rest())) abandon_motion();
}

void Cycle::drive(double plan_time_s) TRN_RT {
  if (dwell_left_s_ > 0) {
    if (plan_time_s > 0) dwell_left_s_ -= config_.period_s;
    return;
  }
  if (plan_time_s <= 0) return;
  if (!take_up_jump()) return latch(Fault::kSetpointJump, -1);
  const auto outcome = interpolator_.advance(plan_time_s);
  if (outcome == Interpolator::Outcome::kBroken) return latch(Fault::kAssertion, -1);
  if (outcome == Interpolator::Outcome::kStarved) return latch(Fault::kStarved, -1);
  if (interpolator_.has_position()) {
    JointVec q;
    if (map_.map(interpolator_.y(), interpolator_.context(), q) != KinStatus::kOk)
      return latch(Fault::kKinematics, -1);
    q_ = q;
  }
  if (outcome == Interpolator::Outcome::kAtEvent) pass_event();
}

// Where the next stretch reads the place in another way (another tool), the corrections of the bracket may
// differ a little though nothing moves.
bool Cycle::take_up_jump() TRN_RT {
  if (!corrections_ || !corrections_->takes_up_jumps() || !interpolator_.at_rest()) return true;
  const MotionBlock* next = queue_.front();
  if (!next || next->segment_count == 0) return true;
  JointVec q;
  if (map_.map(next->piece.at(next->segments[0].s), next->context, q) != KinStatus::kOk) return true;
  const JointVec jump = q_ - q;
  return jump.isZero(0) || corrections_->take_up(jump);
}

void Cycle::pass_event() TRN_RT {
  using Kind = QueueEvent::Kind;
  const QueueEvent event = interpolator_.event().event;
  report_.event = event;
  report_.line = interpolator_.event().line;
  const bool stop = event.kind == Kind::kProgramStop || event.kind == Kind::kOptionalStop;
  if (stop && config_.pause_at_program_stop) {
    motion_ = MotionState::kPaused;  // the event stays in front until kResume
    return;
  }
  if (event.kind == Kind::kDwell) dwell_left_s_ = event.value;
  interpolator_.pass_event();
  if (event.kind == Kind::kProgramEnd) come_to_rest();
}

void Cycle::follow_jog(double target) TRN_RT {
  time_scale_.set_target(target);
  jog_time_s_ += time_scale_.step();
  q_[jog_joint_] = jog_from_ + jog_.at(jog_time_s_);
  if (jog_time_s_ >= jog_.duration_s() || (stopping_ && time_scale_.rate() == 0)) come_to_rest();
}

void Cycle::follow_homing() TRN_RT {
  // The drive moves by itself, and what it reads jumps when it finds its position.
  q_last_ = feedback_.q;
  q_ = feedback_.q - offset_;
  if (feedback_.state == DriveState::kHoming) homing_seen_ = homing_mask_;
  const bool done = feedback_.state == DriveState::kEnabled && homing_seen_ == homing_mask_;
  if (done && (feedback_.homed_mask & homing_mask_) == homing_mask_) come_to_rest();
  homing_seen_ = homing_mask_;  // a drive that needs no search is done by the next period
}

void Cycle::come_to_rest() TRN_RT {
  motion_ = MotionState::kRest;
  stopping_ = waiting_ = false;
  dwell_left_s_ = 0;
}

void Cycle::abandon_motion() TRN_RT {
  interpolator_.abandon();
  come_to_rest();
}

void Cycle::correct_setpoints() TRN_RT {
  if (corrections_ && (corrections_->size() > 0 || corrections_->takes_up_jumps())) {
    corrections_->step({q_, feedback_});
    offset_ = corrections_->offset();
  }
  q_sent_ = q_ + offset_;
}

void Cycle::check_setpoints() TRN_RT {
  const bool commanded = motion_ != MotionState::kHoming && synchronised_;
  if (!commanded) return;
  for (std::size_t i = 0; i < config_.joints.size(); ++i) {
    const JointLimit& limit = config_.joints[i].limit;
    const auto k = static_cast<Eigen::Index>(i);
    const double q = q_sent_[k], step = q - q_last_[k];
    if (step == 0) continue;  // a joint that stands outside its range (after a crash) may stay there
    const bool outside = (q > limit.max + kRounding && step > 0) || (q < limit.min - kRounding && step < 0);
    const bool jump = !(std::abs(step) <= limit.velocity * config_.period_s * (1 + kRounding) + 1e-12);
    if (!outside && !jump) continue;
    q_sent_ = q_last_;
    q_ = q_last_ - offset_;
    drives_.quick_stop();
    return latch(jump ? Fault::kSetpointJump : Fault::kJointLimit, static_cast<int>(i));
  }
}

void Cycle::watch_drives() TRN_RT {
  if (feedback_.fault != Fault::kOk) latch(feedback_.fault, feedback_.fault_joint);
  synchronised_ = feedback_.state == DriveState::kEnabled;
  const bool working = synchronised_ || feedback_.state == DriveState::kHoming;
  if (!working && motion_ != MotionState::kRest && motion_ != MotionState::kHoming) abandon_motion();
  if (motion_ == MotionState::kHoming && feedback_.state == DriveState::kOff) come_to_rest();
}

void Cycle::latch(Fault fault, int joint) TRN_RT {
  const bool worse = fault_info(fault).reaction > fault_info(fault_).reaction;
  if (fault_ != Fault::kOk && !worse)
    return;  // the first one tells the cause, unless a later one asks for more
  fault_ = fault;
  fault_joint_ = joint;
  const Reaction reaction = fault_info(fault).reaction;
  if (reaction == Reaction::kPathStop && motion_ != MotionState::kRest) stopping_ = true;
  if (reaction == Reaction::kQuickStop) {
    drives_.quick_stop();
    abandon_motion();
  }
}

void Cycle::report_corrections() TRN_RT {
  if (!corrections_) return;
  for (int i = 0; i < corrections_->size(); ++i) {
    auto& link = report_.corrections[static_cast<std::size_t>(i)];
    link = {corrections_->offset(i), corrections_->enabled(i), corrections_->warning(i)};
  }
}

void Cycle::report_tool_load() TRN_RT {
  const DeflectionCorrection* source = corrections_ ? corrections_->deflection() : nullptr;
  if (!source) return;
  const DeflectionEstimator::Output& estimate = source->estimate();
  report_.tool_load = {estimate.force_N, estimate.deflection_mm, corrections_->deflection_shift_mm(),
                       estimate.known && source->config().trained, estimate.alarm};
}

void Cycle::write_report() TRN_RT {
  report_.period = period_++;
  report_.q_plan = q_;
  report_.q_setpoint = q_sent_;
  report_corrections();
  report_tool_load();
  report_.q_measured = feedback_.q;
  report_.current_A = feedback_.current_A;
  report_.y = interpolator_.y();
  report_.context = interpolator_.context();
  report_.on_path = interpolator_.has_position();
  report_.speed_mm_s = (report_.y - y_last_).head<3>().norm() / config_.period_s;
  y_last_ = report_.y;
  report_.override_now = motion_ == MotionState::kJogging ? time_scale_.rate() : path_rate_.rate();
  if (report_.event.kind == QueueEvent::Kind::kNone) report_.line = interpolator_.line();
  report_.homed_mask = feedback_.homed_mask;
  report_.limit_switch_mask = feedback_.limit_switch_mask;
  report_.fault = fault_;
  report_.fault_joint = fault_joint_;
  report_.motion = motion_ == MotionState::kHeld && stopping_ ? MotionState::kMoving : motion_;
  report_.drives = feedback_.state;
  if (!reports_.try_push(report_)) ++report_.lost_reports;
}

}  // namespace trn
