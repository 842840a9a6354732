#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/fault.h"
#include "core/ports.h"
#include "hal/can/brake.h"
#include "hal/can/cia402_axis.h"
#include "hal/can/cia402_touch.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "hal/can/tick_sdo.h"

namespace trn {

/// How a node is watched, in periods of the tick.
struct NodeWatchConfig {
  std::uint32_t missed_max = 3;         ///< periods without feedback
  std::uint32_t heartbeat_periods = 0;  ///< longest pause between heartbeats or answers; 0: none expected
  std::uint32_t guard_periods = 0;      ///< ask for a guarding answer this often; 0: never
};

/// How a drive tells that its Safe Torque Off is active.
struct StoSign {
  bool known = false, in_statusword = true;  ///< else in 0x60FD
  int bit = 0;
  bool when_on = true;  ///< the bit is on then
};

/// One node in the tick: its PDOs in and out, what else it says, and its axis. Pure; frames in, frames out.
class NodeLink {
 public:
  struct Config {
    int id = 1, joint = 0;
    bool gantry = false;  ///< one of several motors of the joint
    int home_group = 0;   ///< joints of a lower number are homed before
    std::string name;     ///< "can0 node 3 (joint Z)", for messages
    std::vector<Pdo> rpdos, tpdos;
    NodeWatchConfig watch;
    Cia402Axis::Config axis;
    bool limit_switches = true;  ///< 0x60FD, bits 0 and 1
    Brake::Config brake;
    StoSign sto;
    bool reads_inputs = false;      ///< 0x60FD with every SYNC
    std::uint32_t output_mask = 0;  ///< bits of 0x60FE that signals switch
    unsigned touch_input_bit = 0;   ///< of 0x60FD: the touch probe is closed
    bool mode_by_sdo = false;       ///< 0x6060 and 0x6061 cannot be mapped: they are written and read by SDO
    bool display_by_sdo = false;
    bool has_error_code = false;  ///< 0x603F, read when the drive faults
  };
  /// What other threads may know; written by the tick.
  struct Shared {
    std::atomic<bool> watched = false;        ///< by the bring-up: set up and told to start
    std::atomic<bool> needs_setup = true;     ///< by the tick: it must be set up again
    std::atomic<bool> braked = true;          ///< by the tick: its brake, if it has one, holds the axis alone
    std::atomic<std::uint32_t> setups = 0;    ///< by the bring-up: how often it was set up
    std::atomic<bool> position_lost = false;  ///< by the bring-up: it has been restarted
    std::atomic<std::uint16_t> statusword = 0, emergency = 0, error_code = 0;
    std::atomic<std::uint16_t> ignoring_statusword = 0;  ///< when the drive was found to ignore its target
    std::atomic<std::int16_t> torque = 0;                ///< 0x6077, thousandths of the rated torque
    std::atomic<std::uint8_t> nmt = 255, error_register = 0;
    std::atomic<Fault> fault = Fault::kOk;
    std::atomic<std::uint32_t> missed = 0, wrong_length = 0, guard_toggle_errors = 0;
  };

  explicit NodeLink(const Config& config);

  /// Once a period, before the frames: has it been set up since?
  void begin_period() TRN_RT;
  /// A frame that may be this node's.
  void receive(const CanFrame& frame) TRN_RT;
  /// Feed-forward of the next step, as Cia402Axis::set_offsets.
  void set_offsets(double velocity, double force) TRN_RT { axis_.set_offsets(velocity, force); }
  DriveWords words() const TRN_RT { return {input_.statusword, output_.controlword}; }
  /// N or Nm that the motor makes; false: the drive does not tell.
  bool force(double& force) const TRN_RT;
  /// Once a period, after all frames were received.
  void step(double q, double qd, bool follow) TRN_RT;
  static constexpr std::size_t kFramesMax = 6;
  using Frames = std::array<CanFrame, kFramesMax>;
  /// RPDOs of this period, a guarding request when one is due, and an SDO request; returns how many.
  int fill(Frames& frames) TRN_RT;
  /// The bus is gone: what can be known without it.
  void lose(Fault fault) TRN_RT;
  void reset() TRN_RT;
  /// Behind `step`: quick stop with the frames of this very period, for a motor whose partner has failed.
  void halt() TRN_RT;

  /// 0x60FE from now on, beside the brake.
  void set_outputs(std::uint32_t on) TRN_RT { outputs_ = on; }
  void enable() TRN_RT;
  /// Lets go, the brake first.
  void disable() TRN_RT;
  const Brake& brake() const TRN_RT { return brake_; }
  /// 0x60FD as last heard.
  std::uint32_t inputs() const TRN_RT { return inputs_; }
  bool inputs_heard() const TRN_RT { return inputs_heard_; }

  Cia402Axis& axis() TRN_RT { return axis_; }
  const Cia402Axis& axis() const TRN_RT { return axis_; }
  DriveState state() const TRN_RT;
  /// Of the node or its drive, whichever asks for more.
  Fault fault() const TRN_RT;
  /// 0x60FD: bit 0 negative, bit 1 positive.
  unsigned limit_switches() const TRN_RT { return config_.limit_switches ? inputs_ & 3u : 0; }
  Cia402Touch& touch() TRN_RT { return touch_; }
  const Cia402Touch& touch() const TRN_RT { return touch_; }
  /// The touch probe is closed, as far as this drive knows: its input is slow, what it has latched is not.
  bool touch_contact() const TRN_RT;
  std::int32_t target_counts() const TRN_RT { return output_.position; }
  const Config& config() const TRN_RT { return config_; }
  Shared& shared() { return *shared_; }
  const Shared& shared() const { return *shared_; }
  /// The fault in words: who, what, what would be right. Any thread.
  std::string explain() const;

 private:
  std::string details() const;
  struct Place {
    int pdo = -1, byte = 0, bits = 0;
  };

  static Place place(const std::vector<Pdo>& pdos, ObjectKey key);
  void take_pdo(std::size_t number, const CanFrame& frame) TRN_RT;
  void take_state(const CanFrame& frame) TRN_RT;
  void take_emergency(const CanFrame& frame) TRN_RT;
  void watch() TRN_RT;
  void take_sdo() TRN_RT;
  void step_sdo() TRN_RT;
  void show_mode() TRN_RT;
  void step_brake() TRN_RT;
  bool sto_active() const TRN_RT;
  bool is_due(const Pdo& pdo) const TRN_RT;
  void fail(Fault fault, bool needs_setup) TRN_RT;
  void put(const Place& place, std::uint64_t value, Frames& frames) const TRN_RT;

  Config config_;
  Cia402Axis axis_;
  Cia402Axis::Input input_;
  Cia402Axis::Output output_;
  Cia402Touch touch_;
  Brake brake_;
  bool letting_go_ = false;  ///< disabled as soon as the brake holds
  TickSdo sdo_;
  Place status_, position_, mode_display_, digital_inputs_, touch_status_, touch_rise_, touch_fall_, torque_;
  Place control_, target_, velocity_, mode_, touch_function_, velocity_offset_, torque_offset_,
      torque_target_, digital_outputs_;
  std::unique_ptr<Shared> shared_;
  Fault fault_ = Fault::kOk;
  bool lost_ = false, fresh_ = false, guard_toggle_ = false, guard_known_ = false, was_watched_ = false;
  bool hears_past_ = false;  ///< what arrives in this period may be older than the set-up
  std::uint32_t setups_seen_ = 0, periods_ = 0, missed_ = 0, since_heartbeat_ = 0, since_guard_ = 0;
  unsigned inputs_ = 0;
  std::int16_t torque_now_ = 0;  ///< 0x6077
  std::uint32_t outputs_ = 0;
  bool inputs_heard_ = false;                  ///< since the last set-up
  std::int8_t sent_mode_ = 0, told_mode_ = 0;  ///< by SDO, on its way and taken by the drive
  std::int8_t wanted_mode_ = 0;                ///< of the last period
  std::uint32_t since_mode_ = 0;               ///< periods since it changed
  std::uint32_t since_display_ = 0;            ///< since 0x6061 was asked for
  bool asks_error_ = false, was_faulty_ = false;
};

}  // namespace trn
