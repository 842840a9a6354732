#include "tests/world/watched_drives.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "app/check/trace_reader.h"
#include "core/fault.h"
#include "sim/simulated_joint.h"
#include "tests/world/promises.h"
#include "tests/world/scheduler.h"

namespace trn::world {

namespace {

// A command is heard once in 5 ms, travels to the tick within a period and acts there.
constexpr std::int64_t kStopNs = 20 * kMillisecond;
// The simulated drives brake with twice the joint's acceleration: 400 mm/s takes 50 ms, and the servo
// follows.
constexpr double kBrake_s = 0.15;
constexpr double kStands = 1e-4, kBegins_mm = 0.1, kFallen = 0.5;
constexpr int kPower = 500;              // periods: a drive on CAN has braked and is off
constexpr int kFalls = 60, kCalm = 100;  // periods: a brake closes within, and what was broken is forgotten

}  // namespace

WatchedDrives::WatchedDrives(Drives& inner, const Machine& machine, Harm& harm)
    : inner_(inner),
      machine_(machine),
      harm_(harm),
      judge_(machine.joints, machine.period_s),
      q_last_(JointVec::Zero(static_cast<Eigen::Index>(machine.joints.size()))),
      q_before_(q_last_),
      place_last_(q_last_),
      brake_periods_(static_cast<std::uint64_t>(std::ceil(kBrake_s / machine.period_s))) {}

void WatchedDrives::bring_up() {
  since_stop_ = -1;
  if (!harm_.one_thread()) return inner_.bring_up();
  asked_ = true;
  while (asked_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!refusal_.empty()) throw std::runtime_error(refusal_);
}

void WatchedDrives::bring_up_if_asked() {
  if (!asked_ || !harm_.may_bring_up()) return;
  refusal_.clear();
  try {
    inner_.bring_up();
  } catch (const std::exception& error) {
    refusal_ = error.what();
  }
  asked_ = false;
  stood_ = place_last_;
  since_bring_up_ = stands_ ? 0 : kFalls;
}

// An axis that hangs and stood is still there when the bring-up has taken the torque of its drive, and
// nothing was broken meanwhile or shortly before.
void WatchedDrives::judge_fall(DriveState state) {
  since_harm_ = harm_.acted() ? 0 : since_harm_ + 1;
  const bool moves = state == DriveState::kEnabled || state == DriveState::kHoming;
  since_bring_up_ = moves ? kFalls : std::min(since_bring_up_ + 1, kFalls);
  if (since_bring_up_ == kFalls || since_harm_ < kCalm) return;
  const JointVec fallen = (harm_.places() - stood_).cwiseAbs();
  if (fallen.maxCoeff() > kFallen)
    Chronicle::finding("no fall", fmt::format("an axis fell by {:.3f} mm at a bring-up", fallen.maxCoeff()));
}

void WatchedDrives::shut_down() noexcept {
  stopped_at_ = 0;
  inner_.shut_down();
}

void WatchedDrives::exchange(const Setpoints& setpoints, Feedback& feedback) noexcept {
  ++period_;
  bring_up_if_asked();
  harm_.step();
  inner_.exchange(setpoints, feedback);
  for (const double q : setpoints.q) Chronicle::count(std::bit_cast<std::uint64_t>(q));
  judge(setpoints, feedback.state == DriveState::kEnabled);
  judge_stop(feedback);
  judge_rest(feedback);
  judge_fall(feedback.state);
  judge_power(feedback.state);
  q_before_ = q_last_;
  q_last_ = feedback.q;
  const JointVec places = harm_.places();
  stands_ = (places - place_last_).cwiseAbs().maxCoeff() < kStands;
  place_last_ = places;
}

// Also where a bring-up was under way when the stop came.
void WatchedDrives::judge_power(DriveState state) {
  if (harm_.acted()) since_stop_ = -1;
  if (since_stop_ < 0 || ++since_stop_ < kPower || state != DriveState::kEnabled) return;
  Chronicle::finding("no power",
                     fmt::format("{} periods after a quick stop the drives are on, and nobody has brought "
                                 "them up since",
                                 since_stop_.load()));
}

// A drive that has just been enabled obeys the next setpoint: that one begins where the joint stands.
void WatchedDrives::judge(const Setpoints& setpoints, bool enabled) {
  const bool begins = obeyed_ == 0;
  obeyed_ = enabled && was_enabled_ ? obeyed_ + 1 : 0;
  was_enabled_ = enabled;
  if (obeyed_ == 0) return;
  if (begins && (setpoints.q - q_last_).cwiseAbs().maxCoeff() > kBegins_mm)
    Chronicle::finding("no jump", fmt::format("the first setpoint is {:.3f} mm from where the drives stand",
                                              (setpoints.q - q_last_).cwiseAbs().maxCoeff()));
  if (begins) {
    const JointVec stands = standing_at(setpoints.q);
    judge_ = LimitJudge(joints_around(stands), machine_.period_s);
    judge_row(period_ - 1, stands);  // it stands there, and may move with the very first one
  }
  judge_row(period_, setpoints.q);
  if (judge_.within_limits()) return;
  for (std::size_t joint = 0; joint < judge_.verdicts().size(); ++joint)
    for (std::size_t k = 0; k < kQuantityCount; ++k) {
      const Peak& peak = judge_.verdicts()[joint].peaks[k];
      if (peak.over == 0) continue;
      Chronicle::finding("joint limit", fmt::format("{} {:.6f} of its {}", machine_.joints[joint].name,
                                                    peak.ratio, to_string(static_cast<Quantity>(k))));
    }
}

// Where the joints stand when they are given `first`. A joint that still creeps, as one that sagged until its
// servo took it, is told where it was a period before. That is as near as anybody can tell it.
JointVec WatchedDrives::standing_at(const JointVec& first) const {
  JointVec out = q_last_;
  for (Eigen::Index i = 0; i < out.size(); ++i)
    if (std::abs(first[i] - q_last_[i]) <= std::abs(q_last_[i] - q_before_[i])) out[i] = first[i];
  return out;
}

// A joint that stands outside its range, as where homing was stopped behind the switch, goes no further out.
Joints WatchedDrives::joints_around(const JointVec& q) const {
  Joints joints = machine_.joints;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    JointLimit& limit = joints[i].limit;
    limit.min = std::min(limit.min, q[static_cast<Eigen::Index>(i)]);
    limit.max = std::max(limit.max, q[static_cast<Eigen::Index>(i)]);
  }
  return joints;
}

void WatchedDrives::judge_row(std::uint64_t period, const JointVec& q) {
  TraceRow row;
  row.t_s = static_cast<double>(period) * machine_.period_s;
  row.q.assign(q.begin(), q.end());
  row.digits.assign(row.q.size(), WrittenDigits{17, 17});
  judge_.row(row);
}

void WatchedDrives::expect_stop() {
  const Scheduler& scheduler = *Scheduler::current();
  if (!was_enabled_ || stop_due_ns_ != 0) return;
  stop_due_ns_ = scheduler.now_ns() + kStopNs;
  stop_held_ns_ = scheduler.held_ns();
}

void WatchedDrives::quick_stop() noexcept {
  if (stopped_at_ == 0) stopped_at_ = period_;
  stop_due_ns_ = 0;
  since_stop_ = 0;
  inner_.quick_stop();
}

void WatchedDrives::judge_stop(const Feedback& feedback) {
  if (feedback.state != DriveState::kEnabled) stop_due_ns_ = 0;
  if (stop_due_ns_ == 0) return;
  const Scheduler& scheduler = *Scheduler::current();
  if (scheduler.now_ns() > stop_due_ns_ + (scheduler.held_ns() - stop_held_ns_))
    Chronicle::finding("emergency stop",
                       fmt::format("20 ms after the command the drives still follow setpoints"));
}

void WatchedDrives::judge_rest(const Feedback& feedback) {
  const bool braking = feedback.state == DriveState::kQuickStop || feedback.state == DriveState::kFault ||
                       feedback.state == DriveState::kLost;
  if (!braking) stopped_at_ = 0;
  if (harm_.acted() || stopped_at_ == 0 || period_ < stopped_at_ + brake_periods_) return;
  const JointVec places = harm_.places();
  for (Eigen::Index i = 0; i < places.size(); ++i)
    if (std::abs(places[i] - place_last_[i]) > kStands)
      Chronicle::finding("at rest", fmt::format("{} still moves {:g} s after the quick stop",
                                                machine_.joints[static_cast<std::size_t>(i)].name, kBrake_s));
}

}  // namespace trn::world
