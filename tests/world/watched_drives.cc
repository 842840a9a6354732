#include "tests/world/watched_drives.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>

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
constexpr std::uint64_t kBrakePeriods = 150;
constexpr double kStands_mm = 1e-4, kBegins_mm = 0.1;

}  // namespace

WatchedDrives::WatchedDrives(SimulatedDrives& inner, const Machine& machine, const DriveMalice& malice,
                             std::uint64_t seed)
    : inner_(inner),
      machine_(machine),
      malice_(malice),
      random_(seed),
      judge_(machine.joints, machine.period_s),
      q_last_(JointVec::Zero(static_cast<Eigen::Index>(machine.joints.size()))) {}

void WatchedDrives::shut_down() noexcept {
  stopped_at_ = 0;
  inner_.shut_down();
}

void WatchedDrives::exchange(const Setpoints& setpoints, Feedback& feedback) noexcept {
  ++period_;
  do_harm();
  inner_.exchange(setpoints, feedback);
  for (const double q : setpoints.q) Chronicle::count(std::bit_cast<std::uint64_t>(q));
  judge(setpoints, feedback.state == DriveState::kEnabled);
  judge_stop(feedback);
  judge_rest(feedback);
  q_last_ = feedback.q;
}

void WatchedDrives::do_harm() {
  const auto joints = machine_.joints.size();
  if (period_ == lost_until_)
    for (std::size_t i = 0; i < joints; ++i) inner_.joint(static_cast<int>(i)).set_lost(false);
  if (period_ == stuck_until_)
    for (std::size_t i = 0; i < joints; ++i) inner_.joint(static_cast<int>(i)).set_stuck(false);
  const double share = static_cast<double>(random_() >> 11) * 0x1p-53;
  if (share >= malice_.fault_share) return;
  SimulatedJoint& joint = inner_.joint(static_cast<int>(random_() % joints));
  const std::uint64_t until = period_ + 1 + random_() % 400;
  switch (random_() % 4) {
    case 0:
      Chronicle::note("harm: a drive faults");
      return joint.fail(Fault::kDriveFault);
    case 1:
      Chronicle::note("harm: a drive does not answer");
      lost_until_ = until;
      return joint.set_lost(true);
    case 2:
      Chronicle::note("harm: an axis is stuck");
      stuck_until_ = until;
      return joint.set_stuck(true);
    default:
      Chronicle::note("harm: brown-out, all drives restart");
      for (std::size_t i = 0; i < joints; ++i) inner_.joint(static_cast<int>(i)).power_cycle();
  }
}

// A drive that has just been enabled obeys the next setpoint: that one begins where the joint stands.
void WatchedDrives::judge(const Setpoints& setpoints, bool enabled) {
  const bool begins = obeyed_ == 0;
  if (!enabled && obeyed_ > 0) judge_.next_piece();
  obeyed_ = enabled && was_enabled_ ? obeyed_ + 1 : 0;
  was_enabled_ = enabled;
  if (obeyed_ == 0) return;
  if (begins && (setpoints.q - q_last_).cwiseAbs().maxCoeff() > kBegins_mm)
    Chronicle::finding("no jump", fmt::format("the first setpoint is {:.3f} mm from where the drives stand",
                                              (setpoints.q - q_last_).cwiseAbs().maxCoeff()));
  TraceRow row;
  row.t_s = static_cast<double>(period_) * machine_.period_s;
  row.q.assign(setpoints.q.begin(), setpoints.q.end());
  row.digits.assign(row.q.size(), WrittenDigits{17, 17});
  judge_.row(row);
  if (judge_.within_limits()) return;
  for (std::size_t joint = 0; joint < judge_.verdicts().size(); ++joint)
    for (std::size_t k = 0; k < kQuantityCount; ++k) {
      const Peak& peak = judge_.verdicts()[joint].peaks[k];
      if (peak.over == 0) continue;
      Chronicle::finding("joint limit", fmt::format("{} {:.6f} of its {}", machine_.joints[joint].name,
                                                    peak.ratio, to_string(static_cast<Quantity>(k))));
    }
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
  const bool heard_again = period_ == lost_until_;  // the place jumps from the last one that was told
  if (heard_again || stopped_at_ == 0 || period_ < stopped_at_ + kBrakePeriods) return;
  for (Eigen::Index i = 0; i < feedback.q.size(); ++i)
    if (std::abs(feedback.q[i] - q_last_[i]) > kStands_mm)
      Chronicle::finding("at rest",
                         fmt::format("{} still moves {} periods after the quick stop",
                                     machine_.joints[static_cast<std::size_t>(i)].name, kBrakePeriods));
}

}  // namespace trn::world
