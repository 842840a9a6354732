#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"
#include "core/touch_probe.h"
#include "hal/can/can_config.h"
#include "hal/can/can_drives.h"
#include "sim/canopen/emulated_node.h"
#include "sim/canopen/emulated_probe.h"
#include "sim/canopen/virtual_bus.h"

namespace trn {

/// Nodes for every drive of the config, with plants from section [drives.emulation] (keys as for simulated
/// drives; it may be missing). One entry a bus, in the order of the config.
std::vector<std::vector<std::unique_ptr<EmulatedNode>>> make_emulated_nodes(const Machine& machine,
                                                                            const CanDrivesConfig& config,
                                                                            const ConfigTable& drives);

/// The whole field in one process: real master, virtual buses, emulated nodes, a virtual clock that an
/// exchange moves on by a period. Deterministic; for simulation and tests, one thread.
class EmulatedCanDrives final : public Drives, public TouchDrives {
 public:
  EmulatedCanDrives(const Machine& machine, const ConfigTable& drives)
      : EmulatedCanDrives(machine, drives, machine, drives) {}
  /// The nodes are built and wired as another config has it, on the same buses with the same node ids.
  EmulatedCanDrives(const Machine& machine, const ConfigTable& drives, const Machine& truth,
                    const ConfigTable& true_drives);

  /// ConfigError for a joint whose homing method no emulation has: a maker's own.
  void bring_up() override;
  void shut_down() noexcept override { master_->shut_down(); }
  void reset_faults() override { master_->reset_faults(); }
  unsigned closed_ends(int joint) const override { return master_->closed_ends(joint); }
  std::string explain_fault(int joint) const override;
  std::string health() const override { return master_->health(); }
  std::vector<std::string> warnings() const override { return master_->warnings(); }
  int feedback_periods() const override { return master_->feedback_periods(); }
  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override;
  void request_home(unsigned joint_mask) TRN_RT override { master_->request_home(joint_mask); }
  void quick_stop() TRN_RT override { master_->quick_stop(); }
  int touch_periods() const TRN_RT override { return master_->touch_periods(); }
  void arm_touch(bool contact) TRN_RT override { master_->arm_touch(contact); }
  void disarm_touch() TRN_RT override { master_->disarm_touch(); }
  const TouchProbe& touch() const TRN_RT override { return master_->touch(); }

  CanDrives& master() { return *master_; }
  VirtualBus& bus(std::size_t index) { return *buses_[index]; }
  EmulatedNode& node(std::size_t bus, std::size_t index) { return *nodes_[bus][index]; }
  const CanDrivesConfig& config() const { return config_; }

 private:
  class Opener;

  CanDrivesConfig config_;
  ConfigTable drives_;
  std::vector<std::unique_ptr<VirtualBus>> buses_;
  std::vector<std::vector<std::unique_ptr<EmulatedNode>>> nodes_;
  std::unique_ptr<CanDrives> master_;
  std::int64_t period_ns_;
  JointVec standing_;  ///< at power-on; what is known before the drives have said anything
  EmulatedProbe probe_;
};

}  // namespace trn
