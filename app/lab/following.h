#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/machine.h"
#include "kernel/rt_messages.h"

namespace trn {

/// How far an axis was from the setpoint that its measurement belongs to, mm or rad.
struct FollowingError {
  double worst = 0, rms = 0;
};

/// Watches a run for the following errors of its joints, from its first motion on.
class FollowingMeter final : public ReportSink {
 public:
  /// `feedback_periods`: as Drives has it.
  FollowingMeter(std::size_t joints, int feedback_periods)
      : lag_(static_cast<std::size_t>(feedback_periods)), sum_(joints), worst_(joints) {}

  void write(const CycleReport& report) override;
  std::vector<FollowingError> errors() const;

 private:
  std::size_t lag_;
  std::deque<JointVec> setpoints_;  ///< newest last
  std::vector<double> sum_, worst_;
  std::uint64_t periods_ = 0;
};

/// What a program's joints do with one way of telling the drives.
struct FollowingRun {
  std::string_view name;  ///< "without", "velocity", "velocity and torque"
  bool velocity = false, torque = false;
  std::vector<FollowingError> errors;  ///< by joint
};

/// Runs the program on the machine's emulated drives without feed-forward, with velocity offsets, and with
/// both. `make`: the machine anew for each run. std::runtime_error where a run ends with a fault.
std::vector<FollowingRun> run_following(const std::function<Assembly()>& make, const std::string& program,
                                        const std::string& tools);

std::string following_table(const std::vector<FollowingRun>& runs, const Machine& machine);
std::string following_json(const std::vector<FollowingRun>& runs, const Machine& machine);

}  // namespace trn
