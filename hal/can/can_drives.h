#pragma once

#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/fault.h"
#include "core/ports.h"
#include "core/touch_probe.h"
#include "hal/can/brake.h"
#include "hal/can/bus.h"
#include "hal/can/can_config.h"
#include "hal/can/can_master.h"
#include "hal/can/gantry_link.h"
#include "hal/can/node_link.h"
#include "hal/can/node_setup.h"

namespace trn {

/// CiA 402 drives on one or several CAN buses. A setpoint is sent in its period, acts with the SYNC after it,
/// and is measured with the one after that; feedback is of the SYNC before. The tick uses an endpoint of its
/// own; bring-up and SDO use another one, from the thread that calls bring_up.
class CanDrives final : public Drives, public TouchDrives {
 public:
  CanDrives(const CanDrivesConfig& config, std::unique_ptr<CanOpener> opener);

  void bring_up() override;
  void shut_down() noexcept override;
  void reset_faults() override;
  /// The next bring-up need not wait: no drive that it sets up, and takes the torque of, holds its axis in
  /// the brake's place. Any thread.
  bool brakes_hold() const { return held_by_drive() == nullptr; }
  std::string explain_fault(int joint) const override;
  std::string health() const override;
  std::vector<std::string> warnings() const override;
  unsigned closed_ends(int joint) const override;
  int feedback_periods() const override { return 2; }

  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override;
  void request_home(unsigned joint_mask) TRN_RT override;
  void quick_stop() TRN_RT override;
  int touch_periods() const TRN_RT override;
  void arm_touch(bool contact) TRN_RT override;
  void disarm_touch() TRN_RT override;
  const TouchProbe& touch() const TRN_RT override { return touch_; }

  const GantryLink& gantry(std::size_t index) const { return *gantries_[index]; }
  const CanMaster& master(std::size_t bus) const { return *buses_[bus]->master; }

 private:
  enum Request : unsigned { kEnable = 1, kDisable = 2, kReset = 4 };
  struct Bus {
    std::unique_ptr<CanMaster> master;
    std::unique_ptr<CanEndpoint> service;              ///< bring-up's
    std::vector<std::unique_ptr<CanEndpoint>> opened;  ///< the tick's, the last one in use
    std::atomic<CanEndpoint*> offered = nullptr;
    std::atomic<CanEndpoint*> in_use = nullptr;
    std::atomic<Fault> fault = Fault::kOk;
    std::atomic<bool> lost = false;  ///< by the tick: its endpoint is of no use any more
  };

  static bool restore(Bus& bus);
  void open(Bus& bus);
  static std::vector<NodeLink*> nodes_to_set_up(Bus& bus);
  const NodeLink* held_by_drive() const;
  void wait_for_brakes() const;
  static std::vector<NodeSetup> make_setups(Bus& bus, const std::vector<NodeLink*>& nodes);
  void set_up(Bus& bus);
  static void run(std::vector<NodeSetup>& setups, CanEndpoint& endpoint);
  void finish(const std::vector<NodeLink*>& nodes, const std::vector<NodeSetup>& setups);

  void make_gantries();
  void step_nodes(const Setpoints& setpoints) TRN_RT;
  void take_requests() TRN_RT;
  void home_next() TRN_RT;
  void report(Feedback& feedback) TRN_RT;
  void report_node(const NodeLink& node, Feedback& feedback) TRN_RT;
  void report_touch(const NodeLink& node) TRN_RT;
  static void report_brake(const Brake& brake, HeldOutputs& held) TRN_RT;

  CanDrivesConfig config_;
  std::unique_ptr<CanOpener> opener_;
  std::vector<std::unique_ptr<Bus>> buses_;
  std::vector<std::unique_ptr<GantryLink>> gantries_;
  std::atomic<unsigned> requests_ = 0;
  mutable std::mutex warnings_mutex_;                         ///< never taken by the tick
  std::map<std::string, std::vector<std::string>> warnings_;  ///< by node, of its last bring-up
  TouchProbe touch_;
  std::array<unsigned, kMaxJoints> ends_{};                      ///< of this period
  std::array<std::atomic<unsigned>, kMaxJoints> closed_ends_{};  ///< of the last one
  unsigned waiting_homes_ = 0;  ///< joints that are homed when their group's turn comes
  bool follow_ = false;         ///< all drives stood enabled in the last period: they obey the setpoints
};

}  // namespace trn
