#include "kernel/cycle.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "kernel/rate_plan.h"
#include "kernel/setpoint_check.h"

namespace trn {

namespace {
constexpr double kQueueFactor = 1.5;  // of the plan time of a stop: with less the motion slows down
constexpr double kLowFactor = 2;      // of that: below, what is seen may decide something
constexpr double kFillS = 1;          // that a start from rest waits for the planner, at most
constexpr double kSettled = 1e-9;     // mm, rad
}  // namespace

Cycle::Cycle(const CycleConfig& config, const CycleParts& parts)
    : config_(config),
      map_(parts.map),
      queue_(parts.queue),
      drives_(parts.drives),
      corrections_(parts.corrections),
      spindle_axis_(parts.spindle_axis),
      commands_(256),
      reports_(config.report_capacity),
      interpolator_(parts.queue, config.X_WB_idle),
      rate_(parts.plans, config.period_s),
      stop_s_(plan_stop_s(config.plan_joints)),
      unusable_s_(2 * config.period_s * (1 + rate_lead_periods(config.period_s))),
      ramp_(config.plan_joints, config.period_s),
      jog_(config.plan_joints, config.period_s),
      single_block_(parts.queue, interpolator_),
      optional_stop_(config.optional_stop),
      probe_(parts.drives, config.joints.size()),
      io_(parts.io, config.period_s, config.spindle_timeout_s),
      safety_(config.safety),
      wires_(config.wires),
      detour_(config.plan_joints, config.period_s, config.spindle_timeout_s, jog_, io_),
      retrace_(config.plan_joints, config.period_s, parts.queue, interpolator_),
      feed_forward_(config.feed_forward, config.plan_joints, config.period_s) {
  const auto n = static_cast<Eigen::Index>(config.joints.size());
  for (JointVec* v :
       {&setpoint_.q, &setpoint_.offset, &setpoint_.q_sent, &setpoint_.last, &setpoint_.stands, &setpoints_.q,
        &setpoints_.qd, &setpoints_.velocity_offset, &setpoints_.force_offset, &feedback_.q})
    v->setZero(n);
  report_.q_plan = report_.q_setpoint = report_.q_measured = setpoint_.q;
}

void Cycle::tick() TRN_RT {
  const CheckScope checks(latched_.check);
  queue_.look();
  take_commands();
  move();
  correct_setpoints();
  check_setpoints();
  tell_drives();
  if (spindle_axis_) spindle_axis_->turn(setpoints_, feed_forward_.on());
  drives_.exchange(setpoints_, feedback_);
  if (spindle_axis_) spindle_axis_->turn_back(feedback_);
  watch_drives();
  exchange_io();
  watch_safety();
  follow_wires();
  latch_failed_check();
  write_report();
  setpoint_.last = setpoint_.q_sent;
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
  if (overrides_.obey(command)) return;
  const bool may_begin = motion_ == MotionState::kRest && latched_.fault == Fault::kOk;
  const bool on_path = motion_ == MotionState::kMoving || motion_ == MotionState::kHeld;
  switch (command.kind) {
    case Kind::kStart:
      return start(command.value != 0);
    case Kind::kHold:
      if (detour_.under_way()) return detour_.hold();
      if (retrace_.moves()) return retrace(0);
      if (on_path) motion_ = MotionState::kHeld;
      return;
    case Kind::kResume:
      return resume();
    case Kind::kStop:
      return stop();
    case Kind::kSingleBlock:
      return single_block_.set(command.value != 0);
    case Kind::kOptionalStop:
      optional_stop_ = command.value != 0;
      return;
    case Kind::kMachineLock:
      return set_lock(command.value != 0);
    case Kind::kJog:
      if (may_begin || (motion_ == MotionState::kJogging && !ending()) || stands_in_hold()) jog(command);
      return;
    case Kind::kSpindle:
    case Kind::kCoolant:
    case Kind::kDigitalOutput:
      if (stands_in_hold()) detour_.switch_output(setpoint_.q, command);
      return;
    case Kind::kRetrace:
      return retrace(command.value);
    case Kind::kHome:
      if (may_begin && !lock_.on) begin_homing(command.joint);
      return;
    case Kind::kQuickStop:
      return quick_stop();
    case Kind::kEmergencyStop:
      quick_stop();
      return latch(Fault::kEmergencyStop, -1);
    case Kind::kCorrection:
      if (corrections_ && command.joint >= 0 && command.joint < corrections_->size())
        corrections_->enable(command.joint, command.value != 0);
      return;
    case Kind::kResetFault:
      latched_ = {};
      return;
    case Kind::kOverride:
    case Kind::kRapidOverride:
    case Kind::kSpindleOverride:
    case Kind::kAdaptiveFeed:
    case Kind::kCount:
      return;
  }
}

void Cycle::start(bool typed_in) TRN_RT {
  if (motion_ != MotionState::kRest) return;
  if (latched_.fault == Fault::kOk) motion_ = MotionState::kMoving;
  report_source({});  // nothing of this program has been driven yet
  single_block_.begin(typed_in);
}

void Cycle::resume() TRN_RT {
  if (motion_ != MotionState::kPaused && motion_ != MotionState::kHeld) return;
  if (detour_.under_way()) return detour_.lead_back();
  if (retrace_.moves()) {
    retrace_.stop();
    retraced_.resumes = true;
    return;
  }
  retrace_.forget();
  if (motion_ == MotionState::kPaused) single_block_.release();
  if (motion_ == MotionState::kPaused && wait_.paused) {
    wait_.tool_confirmed = interpolator_.event().event.kind == QueueEvent::Kind::kToolChange;
    if (!wait_.tool_confirmed) interpolator_.pass_event();
    report_.waits_at = {};
  }
  wait_.paused = false;
  motion_ = MotionState::kMoving;
}

void Cycle::stop() TRN_RT {
  const bool paused = motion_ == MotionState::kPaused && !detour_.under_way();
  if (paused) io_.all_off();
  if (paused || motion_ == MotionState::kRest) abandon_motion();
  if (motion_ == MotionState::kRest || motion_ == MotionState::kHoming) return;
  if (!ending()) ending_ = Ending::kStop;
}

void Cycle::quick_stop() TRN_RT {
  drives_.quick_stop();
  io_.all_off();
  abandon_motion();
}

void Cycle::jog(const RtCommand& command) TRN_RT {
  if (command.joint < 0 || static_cast<std::size_t>(command.joint) >= config_.joints.size()) return;
  if (stands_in_hold()) {
    detour_.jog(setpoint_.q, command.joint, command.value, command.speed);
    return;
  }
  interpolator_.leave_path();
  if (motion_ != MotionState::kJogging) jog_.begin(setpoint_.q);
  jog_.move_on(command.joint, command.value, command.speed);
  motion_ = MotionState::kJogging;
}

// Unlocked, the plan goes on from where the joints have stood.
void Cycle::set_lock(bool on) TRN_RT {
  if (motion_ != MotionState::kRest || on == lock_.on) return;
  if (!on) setpoint_.q = setpoint_.last - setpoint_.offset;
  lock_ = {on, setpoint_.last};
  io_.set_lock(on);
}

void Cycle::begin_homing(int joint) TRN_RT {
  const unsigned all = (1u << config_.joints.size()) - 1;
  homing_.mask = joint < 0 ? all : (1u << joint) & all;
  TRN_CHECK(motion_ == MotionState::kRest);
  interpolator_.leave_path();
  homing_.answered = homing_.mask == 0;
  drives_.request_home(homing_.mask);
  motion_ = MotionState::kHoming;
}

void Cycle::move() TRN_RT {
  report_.event = QueueEvent{};
  report_.answered = false;
  report_.blocks_when_low = 0;
  // Drives without power are followed, so that they start without a jump.
  if (!obeyed_ && ending_ != Ending::kRunOut) setpoint_.q = feedback_.q - setpoint_.offset;
  if (detour_.under_way()) return follow_detour();
  if (retrace_.moves()) return follow_retrace();
  switch (motion_) {
    case MotionState::kRest:
      queue_.front();  // lets a dropped program's blocks go
      return rate_.rest(queue_);
    case MotionState::kPaused:
      return rate_.rest(queue_);
    case MotionState::kHoming:
      return follow_homing();
    case MotionState::kJogging:
      return follow_jog();
    case MotionState::kMoving:
    case MotionState::kHeld:
      return follow_path();
  }
}

// What the operator asks for, as far as the program lets him; the spindle's pace in a thread, whose end a
// hold waits for.
double Cycle::target_rate() TRN_RT {
  if (ending() || probe_.touched()) return 0;
  if (io_.geared()) return std::min(io_.gear_rate(passed_.plan_s, passed_.tip_mm), Overrides::kMax);
  const MotionBlock* block = queue_.front();
  const bool may_hold = !block || block->overrides.feed_hold || interpolator_.at_rest();
  if (motion_ == MotionState::kHeld && may_hold) return 0;
  return overrides_.motion(block);
}

// The rate falls with what is left in the queue: a planner that is late slows the machine down to its own
// pace, one that is gone lets it run out smoothly, and at any moment a hold is shorter than what is left.
double Cycle::rate_by_queue(double wanted) TRN_RT {
  if (dwell_left_s_ > 0 || queue_.sees_stop()) return Overrides::kMax;  // a dwell needs no plan
  const double usable_s = std::max(0.0, queue_.seen_s() - unusable_s_);
  const double full_s = kQueueFactor * stop_s_;
  if (usable_s < kLowFactor * full_s * std::max(wanted, rate_.rate()))
    report_.blocks_when_low = queue_.seen_number();
  return usable_s / full_s;
}

// A motion that begins with less ahead than it needs would begin slowly, and differ from the same program run
// where nothing is late. At rest a wait costs nothing; a planner that takes longer than that is late.
bool Cycle::waits_for_plan(bool short_of_plan) TRN_RT {
  const bool begins = short_of_plan && interpolator_.at_rest() && queue_.front();
  filling_s_ = begins ? filling_s_ + config_.period_s : 0;
  return begins && filling_s_ <= kFillS;
}

void Cycle::follow_path() TRN_RT {
  const double wanted = target_rate();
  if (switch_.settling) return settle(wanted);
  const double by_queue = rate_by_queue(wanted);
  const bool waits = waits_for_plan(by_queue < wanted);
  const double most = waits ? 0 : by_queue;
  const bool late = by_queue < wanted && !waits && (queue_.front() || !interpolator_.at_rest());
  if (late && !planner_late_) ++report_.starvations;
  planner_late_ = late;
  // Both the joints and the probe were last heard at the end of the period before.
  if (io_.probe_found() && !interpolator_.at_rest()) probe_.touch(feedback_.q);
  const auto stands = [&] { return rate_.standing() || interpolator_.at_rest(); };
  if (!ending() && single_block_.pauses(dwell_left_s_ <= 0 && stands())) {
    motion_ = MotionState::kPaused;
    report_source(single_block_.driven({report_.line, report_.step}));
    return;
  }
  const double target = std::min(wanted, most);
  const double stop_in_s =
      ending() ? RateWish::kNoStop : single_block_.to_line_end_s(stop_horizon_s(stop_s_, rate_.rate()));
  passed_.plan_s = interpolator_.at_rest() ? rate_.start(queue_, target)
                                           : rate_.step(queue_, interpolator_.place(), {target, stop_in_s});
  drive(passed_.plan_s);
  if (!stands()) return single_block_.pass_line();
  if (probe_.touched()) end_probe();
  if (!ending()) return;
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
  switch_.off_path = false;
  const Vec3 tip_before = interpolator_.y().head<3>();
  const auto outcome = interpolator_.advance(plan_time_s);
  const Vec3 tip = interpolator_.y().head<3>();
  passed_.tip_mm = io_.geared() ? (tip - tip_before).norm() : 0;
  io_.follow_tip(tip);
  report_source(interpolator_.source());
  if (single_block_.on()) single_block_.see(interpolator_.source());
  io_.apply(interpolator_.take_outputs());
  if (outcome == Interpolator::Outcome::kBroken) return latch(Fault::kAssertion, -1);
  if (outcome == Interpolator::Outcome::kStarved) return latch(Fault::kStarved, -1);
  if (interpolator_.has_position() && !map_setpoint()) return latch(Fault::kKinematics, -1);
  if (outcome == Interpolator::Outcome::kAtEvent) pass_event();
}

// Path point to motor joints. Where the joint map has no answer, the last setpoint stays.
bool Cycle::map_setpoint() TRN_RT {
  overrides_.set_mode(interpolator_.overrides());
  JointVec q;
  if (map_.map(interpolator_.y(), interpolator_.context(), q) != KinStatus::kOk) return false;
  setpoint_.q = q;
  return true;
}

// Where the next stretch reads the place in another way, the corrections of the joint map may differ though
// nothing moves: a little after a change of tools, which the chain takes up; more after a switch of
// corrections, and then the joints go there. False: not yet there.
bool Cycle::meet_next_stretch() TRN_RT {
  const bool takes_up = corrections_ && corrections_->takes_up_jumps();
  if (!switch_.pending && !takes_up) return true;
  const MotionBlock* next = queue_.front();
  if (!next || next->segment_count == 0) return true;
  JointVec q;
  if (map_.map(next->piece.at(next->segments[0].s), next->context, q) != KinStatus::kOk) return true;
  const JointVec way = q - setpoint_.q;
  if (switch_.pending && way.lpNorm<Eigen::Infinity>() > kSettled) {
    begin_settling(way);
    return false;
  }
  switch_.pending = false;
  if (!takes_up || way.isZero(0) || corrections_->take_up(-way)) return true;
  latch(Fault::kSetpointJump, -1);
  return false;
}

void Cycle::begin_settling(const JointVec& way) TRN_RT {
  TRN_CHECK(switch_.pending && !switch_.settling);
  ramp_.begin_way(setpoint_.q, way, std::min(1.0, overrides_.feed()));
  switch_ = {false, true, true};
}

void Cycle::settle(double target) TRN_RT {
  TRN_CHECK(interpolator_.at_rest());
  setpoint_.q = ramp_.step(std::min(1.0, target));
  switch_.settling = !ramp_.ended();
  if (ending() && (!switch_.settling || ramp_.rate() == 0)) abandon_motion();
}

// Behind the plan the correction comes or goes while the machine waits; inside it the joints go to where the
// next stretch has them.
void Cycle::switch_corrections(const QueueEvent& event) TRN_RT {
  if (corrections_) dwell_left_s_ = corrections_->switch_by_program(event.argument, event.value != 0);
  switch_.pending |= (event.argument & kPlannedBits) != 0;
}

// Where the program waits for the operator.
bool Cycle::pauses_at(const QueueEvent& event) const TRN_RT {
  if (config_.stops == ProgramStops::kPass || wait_.tool_confirmed) return false;
  using Kind = QueueEvent::Kind;
  return event.kind == Kind::kProgramStop || (event.kind == Kind::kOptionalStop && optional_stop_) ||
         (event.kind == Kind::kToolChange && event.value == kToolByOperator);
}

// A run has nobody who puts a tool in: it counts as there.
TickIo::Outcome Cycle::obey_event(const QueueEvent& event) TRN_RT {
  const bool passes = event.kind == QueueEvent::Kind::kToolChange && config_.stops == ProgramStops::kPass;
  return passes ? TickIo::Outcome::kDone : io_.obey(event);
}

void Cycle::pass_event() TRN_RT {
  using Kind = QueueEvent::Kind;
  const QueueEvent event = interpolator_.event().event;
  TRN_CHECK(interpolator_.at_rest());
  TRN_CHECK(event.kind != Kind::kNone);
  if (event.kind == Kind::kProbeEnd && (probe_.touched() || io_.probe_found())) return end_probe();
  report_.waits_at = event;
  report_source(interpolator_.event().source);
  if (arms_probe(event)) return;
  const auto outcome = obey_event(event);
  if (outcome == TickIo::Outcome::kWaits) return;
  report_.event = event;
  if (outcome == TickIo::Outcome::kFailed) return latch(io_.failure(), -1);
  if (pauses_at(event)) {
    motion_ = MotionState::kPaused;  // the event stays in front until kResume
    wait_.paused = true;
    return;
  }
  report_.waits_at = {};
  wait_.tool_confirmed = false;
  if (event.kind == Kind::kDwell) dwell_left_s_ = event.value;
  TRN_CHECK(event.kind != Kind::kDwell || (event.value >= 0 && std::isfinite(event.value)));
  overrides_.set_mode(event.overrides);
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

// A touch probe on the drives is armed before the motion towards it begins. True: it waits.
bool Cycle::arms_probe(const QueueEvent& event) TRN_RT {
  if (event.kind != QueueEvent::Kind::kProbeStart) return false;
  const ProbeMove::Wait wait = probe_.arm(static_cast<ProbeMode>(event.argument));
  if (wait == ProbeMove::Wait::kFailed) latch(Fault::kProbe, -1);
  return wait == ProbeMove::Wait::kGoesOn;
}

// The machine stands behind the contact; the rest of the probe move is left out.
void Cycle::end_probe() TRN_RT {
  probe_.touch(feedback_.q);
  const ProbeMove::Wait wait = probe_.take_latched();
  if (wait == ProbeMove::Wait::kFailed) latch(Fault::kProbe, -1);
  if (wait == ProbeMove::Wait::kGoesOn || !interpolator_.skip_to_event()) return;
  probe_.reset();
  io_.end_probe(true);
  report_.event = interpolator_.event().event;
  report_source(interpolator_.event().source);
  answer({1, true, probe_.q_contact(), interpolator_.y()});
  interpolator_.pass_event();
}

void Cycle::exchange_io() TRN_RT {
  const IoPlace place{feedback_.q, interpolator_.context().tool_offset};
  const HeldOutputs& wired = wires_.ends().io_outputs;
  const HeldOutputs held{feedback_.held.mask | wired.mask, feedback_.held.on | wired.on};
  const Fault fault = io_.exchange(place, overrides_.spindle(io_.taps()), probe_.drives_see_contact(), held);
  if (fault != Fault::kOk) latch(fault, -1);
}

void Cycle::follow_jog() TRN_RT {
  if (ending()) jog_.stop();
  setpoint_.q = jog_.step(std::min(1.0, overrides_.feed()));
  if (jog_.ended()) come_to_rest();
}

// The drive moves by itself, and what it reads jumps when it finds its position.
void Cycle::follow_homing() TRN_RT {
  setpoint_.last = feedback_.q;
  setpoint_.q = feedback_.q - setpoint_.offset;
  homing_.answered = homing_.answered || feedback_.state == DriveState::kHoming;
  const bool done = feedback_.state == DriveState::kEnabled && homing_.answered;
  if (done && (feedback_.homed_mask & homing_.mask) == homing_.mask) come_to_rest();
  homing_.answered = true;  // a drive that needs no search is done by the next period
}

void Cycle::come_to_rest() TRN_RT {
  motion_ = MotionState::kRest;
  ending_ = Ending::kNone;
  planner_late_ = false;
  filling_s_ = 0;
  wait_ = {};
  switch_ = {};
  detour_.forget();
  retrace_.forget();
  probe_.reset();
  overrides_.reset_mode();
  dwell_left_s_ = 0;
  report_.waits_at = {};
  if (corrections_) corrections_->forget_program();
}

void Cycle::correct_setpoints() TRN_RT {
  if (corrections_ && (corrections_->size() > 0 || corrections_->takes_up_jumps())) {
    corrections_->step({setpoint_.q, feedback_});
    report_.sensor = corrections_->heard();
    setpoint_.offset = corrections_->offset();
  }
  setpoint_.q_sent = setpoint_.q + setpoint_.offset;
  if (!lock_.on) return;
  if (!obeyed_) lock_.q_sent = setpoint_.q_sent;
  setpoint_.q_sent = lock_.q_sent;
}

// Nothing that was computed behind a failed check goes to the drives.
void Cycle::check_setpoints() TRN_RT {
  if (latched_.check && latched_.fault != Fault::kAssertion) {
    keep_last_setpoint();
    return latch_failed_check();
  }
  if (motion_ == MotionState::kHoming || !obeyed_) return;
  const SetpointVerdict found =
      trn::check_setpoints(config_.joints, config_.period_s, setpoint_.last, setpoint_.q_sent);
  if (found.fault == Fault::kOk) return;
  keep_last_setpoint();
  drives_.quick_stop();
  latch(found.fault, found.joint);
  abandon_motion();
}

void Cycle::keep_last_setpoint() TRN_RT {
  setpoint_.q_sent = setpoint_.last;
  setpoint_.q = setpoint_.last - setpoint_.offset;
}

// Drives that do not obey are told where they stand, so that they come back without a jump.
void Cycle::tell_drives() TRN_RT {
  TRN_CHECK(setpoint_.q_sent.allFinite());
  setpoints_.qd = (setpoint_.q_sent - setpoint_.last) / config_.period_s;
  setpoints_.q = setpoint_.q_sent;
  feed_forward();
  if (obeyed_) return;
  setpoints_.qd.setZero();
  setpoints_.q = setpoint_.stands = feedback_.q;
}

// Corrections change the place only: what they add moves far more slowly than the plan.
void Cycle::feed_forward() TRN_RT {
  if (!feed_forward_.on()) return;
  const bool stands =
      !obeyed_ || lock_.on || motion_ == MotionState::kRest || motion_ == MotionState::kHoming;
  const bool on_path = (motion_ == MotionState::kMoving || motion_ == MotionState::kHeld) &&
                       !detour_.under_way() && !retrace_.moves() && !switch_.settling;
  if (stands || (on_path && interpolator_.at_rest()))
    feed_forward_.stand(setpoint_.q);
  else if (on_path)
    feed_forward_.follow_plan(queue_, interpolator_.place(), rate_.follower());
  else
    feed_forward_.follow_setpoints(setpoint_.q);
  feed_forward_.tell(setpoint_.q, setpoints_);
  report_.velocity_offset = setpoints_.velocity_offset;
  report_.force_offset = setpoints_.force_offset;
}

void Cycle::watch_drives() TRN_RT {
  if (feedback_.fault != Fault::kOk) latch(feedback_.fault, feedback_.fault_joint);
  const bool returned = !obeyed_ && feedback_.state == DriveState::kEnabled;
  obeyed_ = feedback_.state == DriveState::kEnabled;
  const bool working = obeyed_ || feedback_.state == DriveState::kHoming;
  if (!working && motion_ != MotionState::kRest && motion_ != MotionState::kHoming) run_out();
  if (returned && ending_ == Ending::kRunOut) abandon_motion();
  if (returned && motion_ != MotionState::kHoming) stand_where_told();
  if (motion_ == MotionState::kHoming && feedback_.state == DriveState::kOff) come_to_rest();
}

// Drives that are back obey what this period told them, and that was where they stood: from there they go on,
// not from a place that the plan has come to while it ran out.
void Cycle::stand_where_told() TRN_RT {
  setpoint_.q_sent = setpoint_.stands;
  setpoint_.q = setpoint_.q_sent - setpoint_.offset;
  lock_.q_sent = setpoint_.q_sent;
}

void Cycle::latch(Fault fault, int joint) TRN_RT {
  if (worse(latched_.fault, fault) == latched_.fault) return;  // the first is the cause, unless a later one
  latched_.fault = fault;                                      // asks for more
  latched_.joint = joint;
  const Reaction reaction = fault_info(fault).reaction;
  if (reaction == Reaction::kPathStop && motion_ != MotionState::kRest && !ending()) ending_ = Ending::kStop;
  if (reaction != Reaction::kQuickStop) return;
  drives_.quick_stop();
  io_.all_off();
  const bool of_plan =
      fault == Fault::kSetpointJump || fault == Fault::kKinematics || fault == Fault::kAssertion;
  of_plan ? abandon_motion() : run_out();
}

void Cycle::latch_failed_check() TRN_RT {
  if (latched_.check) latch(Fault::kAssertion, -1);
}

// The drives brake by themselves and do not obey any more. The plan runs out on its path meanwhile, so that
// the setpoints never step.
void Cycle::run_out() TRN_RT {
  TRN_CHECK(ending_ != Ending::kRunOut || motion_ != MotionState::kRest);
  const bool moves = motion_ == MotionState::kMoving || motion_ == MotionState::kHeld ||
                     motion_ == MotionState::kJogging || detour_.under_way();
  if (!moves) return abandon_motion();
  ending_ = Ending::kRunOut;
}

void Cycle::abandon_motion() TRN_RT {
  interpolator_.abandon();
  TRN_CHECK(interpolator_.at_rest());
  come_to_rest();
}

}  // namespace trn
