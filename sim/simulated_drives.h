#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/simulated_joint.h"

namespace trn {

/// Drives, motors, switches and encoders of a whole machine, stepped once an exchange; deterministic.
/// bring_up, shut_down and reset_faults may come from another thread than exchange: they leave a request that
/// the next exchange obeys.
class SimulatedDrives final : public Drives {
 public:
  /// Something that goes wrong (or right again) in a given period, for rehearsals.
  struct ScriptedEvent {
    enum class Kind : std::uint8_t { kFault, kLost, kFound, kStuck, kFree };
    std::uint64_t period = 0;
    int joint = 0;
    Kind kind = Kind::kFault;
  };
  struct Config {
    std::vector<SimulatedJoint::Config> joints;
    std::vector<ScriptedEvent> script;
  };

  explicit SimulatedDrives(const Config& config);

  void bring_up() override { enable_asked_ = true; }
  void shut_down() noexcept override { disable_asked_ = true; }
  bool real() const override { return false; }
  void reset_faults() override { reset_asked_ = true; }

  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override;
  void request_home(unsigned joint_mask) TRN_RT override;
  void quick_stop() TRN_RT override;

  /// Fault injection and true positions, for tests; from the thread that calls exchange.
  SimulatedJoint& joint(int index) { return joints_[static_cast<std::size_t>(index)]; }

 private:
  void obey_requests() TRN_RT;
  void run_script() TRN_RT;
  void report(Feedback& feedback) const TRN_RT;

  std::vector<SimulatedJoint> joints_;
  std::vector<ScriptedEvent> script_;
  std::uint64_t period_ = 0;
  std::atomic<bool> enable_asked_ = false, disable_asked_ = false, reset_asked_ = false;
};

/// Reads the keys of `drives` (the section [drives]) for simulated drives; ConfigError as ConfigTable.
SimulatedDrives::Config read_simulated_drives(const Machine& machine, const ConfigTable& drives);

}  // namespace trn
