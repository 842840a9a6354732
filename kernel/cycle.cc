#include "kernel/cycle.h"

#include <algorithm>
#include <cmath>

#include "compensation/micromill/deflection_correction.h"

namespace trn {

namespace {
constexpr double kRounding = 1e-6;          // of a position limit and, relatively, of a step: mm, rad
constexpr PlanShares kJogShares{0.9, 0.8};  // of a jog's limits; the rest stops it at any moment
constexpr double kQueueFactor = 1.5;        // of the plan time of a stop: with less the motion slows down
constexpr double kLowFactor = 2;            // of that: below, what is seen may decide something
constexpr double kOverrideMax = 2;
constexpr double kSettled = 1e-9;  // mm, rad
constexpr double kFast = 1e12;
constexpr double kJogShare = 0.1;  // of the velocity limit when a jog names no speed
}  // namespace

Cycle::Cycle(const CycleConfig& config, const JointMap& map, MotionQueue& queue, Drives& drives,
             SetpointChain* corrections, MachineIo* io)
    : config_(config),
      map_(map),
      queue_(queue),
      drives_(drives),
      commands_(256),
      reports_(config.report_capacity),
      time_scale_(config.plan_joints.empty() ? config.joints : config.plan_joints, kJogShares,
                  config.period_s),
      path_rate_(config.plan_joints.empty() ? config.joints : config.plan_joints, config.period_s),
      interpolator_(queue, config.X_WB_idle),
      io_(io, config.period_s, config.spindle_timeout_s),
      touch_drives_(dynamic_cast<TouchDrives*>(&drives)),
      corrections_(corrections) {
  if (touch_drives_ && touch_drives_->touch_periods() == 0) touch_drives_ = nullptr;
  if (config_.plan_joints.empty()) config_.plan_joints = config_.joints;
  const auto n = static_cast<Eigen::Index>(config.joints.size());
  for (JointVec* v : {&q_, &jog_from_, &jog_way_, &offset_, &q_sent_, &q_last_, &setpoints_.q, &setpoints_.qd,
                      &feedback_.q, &q_contact_})
    v->setZero(n);
  report_.q_plan = report_.q_setpoint = report_.q_measured = q_;
}

void Cycle::tick() TRN_RT {
  queue_.look();
  take_commands();
  move();
  correct_setpoints();
  check_setpoints();
  tell_drives();
  drives_.exchange(setpoints_, feedback_);
  watch_drives();
  exchange_io();
  write_report();
  q_last_ = q_sent_;
}

// Drives that have dropped out are told where they stand, so that they come back without a jump.
void Cycle::tell_drives() TRN_RT {
  setpoints_.qd = (q_sent_ - q_last_) / config_.period_s;
  setpoints_.q = q_sent_;
  if (synchronised_ || !runs_out_) return;
  setpoints_.qd.setZero();
  setpoints_.q = feedback_.q;
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
      step_begins_ = step_begins_ || standing;
      break;
    case Kind::kHold:
      if (on_path) motion_ = MotionState::kHeld;
      break;
    case Kind::kResume:
      resume();
      break;
    case Kind::kStop:
      if (motion_ == MotionState::kPaused) io_.all_off();
      if (standing || motion_ == MotionState::kPaused) abandon_motion();
      stopping_ = motion_ != MotionState::kRest && motion_ != MotionState::kHoming;
      break;
    case Kind::kOverride:
      override_ = std::clamp(command.value, 0.0, kOverrideMax);
      break;
    case Kind::kRapidOverride:
      rapid_override_ = std::clamp(command.value, 0.0, 1.0);
      break;
    case Kind::kSpindleOverride:
      spindle_override_ = std::clamp(command.value, 0.0, kOverrideMax);
      break;
    case Kind::kAdaptiveFeed:
      adaptive_feed_ = std::clamp(command.value, 0.0, 1.0);
      break;
    case Kind::kSingleBlock:
      step_begins_ = step_begins_ || !single_block_;
      single_block_ = command.value != 0;
      break;
    case Kind::kJog:
      if (standing && fault_ == Fault::kOk) begin_jog(command);
      break;
    case Kind::kHome:
      if (standing && fault_ == Fault::kOk) begin_homing(command.joint);
      break;
    case Kind::kQuickStop:
      drives_.quick_stop();
      io_.all_off();
      abandon_motion();
      break;
    case Kind::kCorrection:
      if (corrections_ && command.joint >= 0 && command.joint < corrections_->size())
        corrections_->enable(command.joint, command.value != 0);
      break;
    case Kind::kEmergencyStop:
      drives_.quick_stop();
      io_.all_off();
      abandon_motion();
      latch(Fault::kEmergencyStop, -1);
      break;
    case Kind::kResetFault:
      fault_ = Fault::kOk;
      fault_joint_ = -1;
      break;
  }
}

void Cycle::resume() TRN_RT {
  if (motion_ != MotionState::kPaused && motion_ != MotionState::kHeld) return;
  if (motion_ == MotionState::kPaused) step_begins_ = true;
  if (motion_ == MotionState::kPaused && paused_by_program_) {
    tool_confirmed_ = interpolator_.event().event.kind == QueueEvent::Kind::kToolChange;
    if (!tool_confirmed_) interpolator_.pass_event();
    report_.waits_at = {};
  }
  paused_by_program_ = false;
  motion_ = MotionState::kMoving;
}

void Cycle::begin_jog(const RtCommand& command) TRN_RT {
  const auto joint = static_cast<std::size_t>(command.joint);
  if (joint >= config_.joints.size()) return;
  const JointLimit& limit = config_.plan_joints[joint].limit;
  jog_from_ = q_;
  jog_way_.setZero();
  jog_way_[command.joint] = 1;
  const double from = q_[command.joint];
  const double target = jog_target(limit, from, command.value);
  const double speed = command.speed > 0 ? command.speed : kJogShare * limit.velocity;
  jog_ = SCurve(target - from, std::min(speed, limit.velocity), kJogShares.acceleration * limit.acceleration,
                kJogShares.jerk * limit.jerk);
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
  report_.answered = false;
  report_.blocks_when_low = 0;
  if (!synchronised_ && !runs_out_)
    q_ = feedback_.q - offset_;  // drives without power: follow them, so that they start without a jump
  if (motion_ == MotionState::kRest) queue_.front();  // lets a dropped program's blocks go
  if (motion_ == MotionState::kRest || motion_ == MotionState::kPaused) return;
  if (motion_ == MotionState::kHoming) return follow_homing();
  motion_ == MotionState::kJogging ? follow_jog(stopping_ ? 0.0 : override_) : follow_path();
}

// What the operator asks for, as far as the program lets him; the spindle's pace in a thread, whose end a
// hold waits for.
double Cycle::target_rate() TRN_RT {
  if (stopping_ || contact_) return 0;
  if (io_.geared()) return std::min(io_.gear_rate(passed_s_, passed_mm_), kOverrideMax);
  const MotionBlock* block = queue_.front();
  const OverrideMode mode = block ? block->overrides : OverrideMode{};
  if (motion_ == MotionState::kHeld && (mode.feed_hold || interpolator_.at_rest())) return 0;
  if (block && block->rapid) return rapid_override_;
  return (mode.feed ? override_ : 1.0) * (mode.adaptive ? adaptive_feed_ : 1.0);
}

// The rate falls with what is left in the queue: a planner that is late slows the machine down to its own
// pace, one that is gone lets it run out smoothly, and at any moment a hold is shorter than what is left.
double Cycle::rate_by_queue(double wanted) TRN_RT {
  if (queue_.sees_stop()) return kOverrideMax;
  const double usable_s = std::max(0.0, queue_.seen_s() - 2 * config_.period_s);
  const double full_s = kQueueFactor * path_rate_.stop_s();
  if (usable_s < kLowFactor * full_s * std::max(wanted, path_rate_.rate()))
    report_.blocks_when_low = queue_.seen_number();
  return usable_s / full_s;
}

void Cycle::follow_path() TRN_RT {
  const double wanted = target_rate();
  if (settling_) return settle(wanted);
  const double most = rate_by_queue(wanted);
  const bool late = most < wanted && !interpolator_.at_rest();
  if (late && !waiting_) ++report_.starvations;
  waiting_ = late;
  watch_probe();
  if (!stopping_ && pause_between_lines()) return;
  const double target = std::min(wanted, most);
  if (interpolator_.at_rest()) path_rate_.restart(target);
  passed_s_ = path_rate_.step(queue_, interpolator_.place(), target, way_to_line_end());
  drive(passed_s_);
  const bool stands = path_rate_.standing() || interpolator_.at_rest();
  if (!stands) release_line_passed();
  if (contact_ && stands) end_probe();
  if (!stopping_ || !stands) return;
  io_.all_off();
  abandon_motion();
}

void Cycle::drive(double plan_time_s) TRN_RT {
  if (dwell_left_s_ > 0) {
    if (plan_time_s > 0) dwell_left_s_ -= config_.period_s;
    return;
  }
  if (plan_time_s <= 0) return;
  if (interpolator_.at_rest() && !meet_next_stretch()) return;
  off_path_ = false;
  const Vec3 tip_before = interpolator_.y().head<3>();
  const auto outcome = interpolator_.advance(plan_time_s);
  passed_mm_ = io_.geared() ? (interpolator_.y().head<3>() - tip_before).norm() : 0;
  if (io_.taps()) io_.follow_tip(interpolator_.y().head<3>());
  report_.line = interpolator_.line();
  io_.apply(interpolator_.take_outputs());
  if (outcome == Interpolator::Outcome::kBroken) return latch(Fault::kAssertion, -1);
  if (outcome == Interpolator::Outcome::kStarved) return latch(Fault::kStarved, -1);
  if (interpolator_.has_position()) {
    overrides_ = interpolator_.overrides();
    JointVec q;
    if (map_.map(interpolator_.y(), interpolator_.context(), q) != KinStatus::kOk)
      return latch(Fault::kKinematics, -1);
    q_ = q;
  }
  if (outcome == Interpolator::Outcome::kAtEvent) pass_event();
}

// Where the next stretch reads the place in another way, the corrections of the bracket may differ though
// nothing moves: a little after a change of tools, which the chain takes up; more after a switch of
// corrections, and then the joints go there. False: not yet there.
bool Cycle::meet_next_stretch() TRN_RT {
  const bool takes_up = corrections_ && corrections_->takes_up_jumps();
  if (!switched_ && !takes_up) return true;
  const MotionBlock* next = queue_.front();
  if (!next || next->segment_count == 0) return true;
  JointVec q;
  if (map_.map(next->piece.at(next->segments[0].s), next->context, q) != KinStatus::kOk) return true;
  const JointVec way = q - q_;
  if (switched_ && way.lpNorm<Eigen::Infinity>() > kSettled) {
    begin_settling(way);
    return false;
  }
  switched_ = false;
  if (!takes_up || way.isZero(0) || corrections_->take_up(-way)) return true;
  latch(Fault::kSetpointJump, -1);
  return false;
}

void Cycle::begin_settling(const JointVec& way) TRN_RT {
  double velocity = kFast, acceleration = kFast, jerk = kFast;
  for (std::size_t i = 0; i < config_.plan_joints.size(); ++i) {
    const JointLimit& limit = config_.plan_joints[i].limit;
    const double part = std::abs(way[static_cast<Eigen::Index>(i)]) + kSettled;
    velocity = std::min(velocity, limit.velocity / part);
    acceleration = std::min(acceleration, kJogShares.acceleration * limit.acceleration / part);
    jerk = std::min(jerk, kJogShares.jerk * limit.jerk / part);
  }
  jog_ = SCurve(1, velocity, acceleration, jerk);
  jog_from_ = q_;
  jog_way_ = way;
  jog_time_s_ = 0;
  time_scale_.set_target(std::min(1.0, override_));
  time_scale_.restart();
  switched_ = false;
  settling_ = off_path_ = true;
}

void Cycle::settle(double target) TRN_RT {
  time_scale_.set_target(std::min(1.0, target));
  jog_time_s_ += time_scale_.step();
  q_ = jog_from_ + jog_.at(jog_time_s_) * jog_way_;
  settling_ = jog_time_s_ < jog_.duration_s();
  if (stopping_ && (!settling_ || time_scale_.rate() == 0)) abandon_motion();
}

// Behind the plan the correction comes or goes while the machine waits; inside it the joints go to where the
// next stretch has them.
void Cycle::switch_corrections(const QueueEvent& event) TRN_RT {
  if (corrections_) dwell_left_s_ = corrections_->switch_by_program(event.argument, event.value != 0);
  switched_ |= (event.argument & kPlannedBits) != 0;
}

// Where the program waits for the operator.
bool Cycle::pauses_at(const QueueEvent& event) const TRN_RT {
  if (!config_.pause_at_program_stop || tool_confirmed_) return false;
  using Kind = QueueEvent::Kind;
  return event.kind == Kind::kProgramStop || event.kind == Kind::kOptionalStop ||
         (event.kind == Kind::kToolChange && event.value == kToolByOperator);
}

// A run has nobody who puts a tool in: it counts as there.
IoDesk::Outcome Cycle::obey_event(const QueueEvent& event) TRN_RT {
  const bool passes = event.kind == QueueEvent::Kind::kToolChange && !config_.pause_at_program_stop;
  return passes ? IoDesk::Outcome::kDone : io_.obey(event);
}

void Cycle::pass_event() TRN_RT {
  using Kind = QueueEvent::Kind;
  const QueueEvent event = interpolator_.event().event;
  if (event.kind == Kind::kProbeEnd && (contact_ || io_.probe_found())) return end_probe();
  if (arms_touch(event)) return;
  const auto outcome = obey_event(event);
  report_.waits_at = event;
  if (outcome == IoDesk::Outcome::kWaits) return;
  report_.event = event;
  report_.line = interpolator_.event().line;
  if (outcome == IoDesk::Outcome::kFailed) return latch(io_.failure(), -1);
  if (pauses_at(event)) {
    motion_ = MotionState::kPaused;  // the event stays in front until kResume
    paused_by_program_ = true;
    return;
  }
  report_.waits_at = {};
  tool_confirmed_ = false;
  if (event.kind == Kind::kDwell) dwell_left_s_ = event.value;
  overrides_ = event.overrides;
  if (event.kind == Kind::kCorrection) switch_corrections(event);
  end_of_event(event);
  interpolator_.pass_event();
  if (event.kind == Kind::kProgramEnd) come_to_rest();
}

// What the program's planning waits for.
void Cycle::end_of_event(const QueueEvent& event) TRN_RT {
  using Kind = QueueEvent::Kind;
  if (event.kind == Kind::kWaitInput) answer({io_.input_value(), false, {}, {}});
  if (event.kind == Kind::kToolChange && event.value != kToolByNobody) answer({1, false, {}, {}});
  if (event.kind == Kind::kProbeEnd) answer({0, true, feedback_.q, interpolator_.y()});
}

void Cycle::answer(const ProgramAnswer& answer) TRN_RT {
  queue_.answer(answer);
  report_.answered = true;
  report_.answer = answer;
}

// A touch probe on the drives is armed before the motion towards it begins; the wait is always the same one.
bool Cycle::arms_touch(const QueueEvent& event) TRN_RT {
  if (event.kind != QueueEvent::Kind::kProbeStart || !touch_drives_) return false;
  if (touch_wait_ == 0) touch_drives_->arm_touch(seeks_contact(static_cast<ProbeMode>(event.argument)));
  if (++touch_wait_ <= touch_drives_->touch_periods()) return true;
  touch_wait_ = 0;
  if (!touch_drives_->touch().armed) latch(Fault::kProbe, -1);
  return false;
}

// The drives tell late where they were at the contact. False: they have had their time.
bool Cycle::awaits_touch() TRN_RT {
  if (!touch_drives_ || touch_taken_) return false;
  if (++touch_wait_ <= touch_drives_->touch_periods()) return true;
  touch_wait_ = 0;
  const unsigned all = (1u << config_.joints.size()) - 1;
  if ((touch_drives_->touch().latched_mask & all) == all)
    q_contact_ = touch_drives_->touch().q;
  else
    latch(Fault::kProbe, -1);
  touch_drives_->disarm_touch();
  touch_taken_ = true;  // the rest of the move may take further periods to be skipped
  return false;
}

// Both the joints and the probe were last heard at the end of the period before.
void Cycle::watch_probe() TRN_RT {
  if (contact_ || interpolator_.at_rest() || !io_.probe_found()) return;
  contact_ = true;
  q_contact_ = feedback_.q;
}

// The machine stands behind the contact; the rest of the probe move is left out.
void Cycle::end_probe() TRN_RT {
  if (!contact_) q_contact_ = feedback_.q;
  contact_ = true;
  if (awaits_touch() || !interpolator_.skip_to_event()) return;
  contact_ = touch_taken_ = false;
  io_.end_probe(true);
  report_.event = interpolator_.event().event;
  report_.line = interpolator_.event().line;
  answer({1, true, q_contact_, interpolator_.y()});
  interpolator_.pass_event();
}

void Cycle::exchange_io() TRN_RT {
  const IoPlace place{feedback_.q, interpolator_.context().tool_offset};
  const Fault fault = io_.exchange(place, spindle_share(), touch_drives_ && touch_drives_->touch().contact);
  if (fault != Fault::kOk) latch(fault, -1);
}

void Cycle::follow_jog(double target) TRN_RT {
  time_scale_.set_target(target);
  jog_time_s_ += time_scale_.step();
  q_ = jog_from_ + jog_.at(jog_time_s_) * jog_way_;
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
  stopping_ = runs_out_ = waiting_ = paused_by_program_ = tool_confirmed_ = settling_ = off_path_ =
      switched_ = false;
  report_.waits_at = {};
  overrides_ = {};
  dwell_left_s_ = 0;
  if (corrections_) corrections_->forget_program();
  contact_ = touch_taken_ = false;
  touch_wait_ = 0;
}

void Cycle::abandon_motion() TRN_RT {
  interpolator_.abandon();
  come_to_rest();
}

void Cycle::correct_setpoints() TRN_RT {
  if (corrections_ && (corrections_->size() > 0 || corrections_->takes_up_jumps())) {
    corrections_->step({q_, feedback_});
    report_.sensor = corrections_->heard();
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
    latch(jump ? Fault::kSetpointJump : Fault::kJointLimit, static_cast<int>(i));
    return abandon_motion();
  }
}

void Cycle::watch_drives() TRN_RT {
  if (feedback_.fault != Fault::kOk) latch(feedback_.fault, feedback_.fault_joint);
  const bool returned = !synchronised_ && feedback_.state == DriveState::kEnabled;
  synchronised_ = feedback_.state == DriveState::kEnabled;
  const bool working = synchronised_ || feedback_.state == DriveState::kHoming;
  if (!working && motion_ != MotionState::kRest && motion_ != MotionState::kHoming) run_out();
  if (returned && runs_out_) abandon_motion();
  if (motion_ == MotionState::kHoming && feedback_.state == DriveState::kOff) come_to_rest();
}

void Cycle::latch(Fault fault, int joint) TRN_RT {
  if (worse(fault_, fault) == fault_) return;  // the first tells the cause, unless a later one asks for more
  fault_ = fault;
  fault_joint_ = joint;
  const Reaction reaction = fault_info(fault).reaction;
  if (reaction == Reaction::kPathStop && motion_ != MotionState::kRest) stopping_ = true;
  if (reaction != Reaction::kQuickStop) return;
  drives_.quick_stop();
  io_.all_off();
  const bool of_plan =
      fault == Fault::kSetpointJump || fault == Fault::kKinematics || fault == Fault::kAssertion;
  of_plan ? abandon_motion() : run_out();
}

// The drives brake by themselves and do not obey any more. The plan runs out on its path meanwhile, so that
// the setpoints never step.
void Cycle::run_out() TRN_RT {
  const bool moves =
      motion_ == MotionState::kMoving || motion_ == MotionState::kHeld || motion_ == MotionState::kJogging;
  if (!moves) return abandon_motion();
  stopping_ = runs_out_ = true;
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
  report_.on_path = interpolator_.has_position() && !off_path_;
  report_.speed_mm_s = (report_.y - y_last_).head<3>().norm() / config_.period_s;
  y_last_ = report_.y;
  report_.override_now =
      motion_ == MotionState::kJogging || settling_ ? time_scale_.rate() : path_rate_.rate();
  report_.spindle_rpm = io_.outputs().spindle_rpm * spindle_share();
  report_.single_block = single_block_;
  report_.inputs = io_.inputs().digital;
  report_.outputs = io_.outputs().digital;
  report_.probe = io_.inputs().probe;
  report_.spindle_ready = io_.inputs().spindle_ready;
  report_.reads_encoder = io_.reads_encoder();
  report_.gear_lag_s = io_.geared() ? io_.gear_lag_s() : 0;
  report_.spindle_turns = io_.inputs().spindle_turns;
  report_.homed_mask = feedback_.homed_mask;
  report_.limit_switch_mask = feedback_.limit_switch_mask;
  report_.fault = fault_;
  report_.fault_joint = fault_joint_;
  report_.motion = motion_ == MotionState::kHeld && stopping_ ? MotionState::kMoving : motion_;
  report_.drives = feedback_.state;
  if (!reports_.try_push(report_)) ++report_.lost_reports;
}

}  // namespace trn
