#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "hal/can/pdo.h"
#include "sim/canopen/emulated_drive.h"
#include "sim/canopen/emulated_lss.h"
#include "sim/canopen/frame_queue.h"
#include "sim/canopen/object_store.h"
#include "sim/canopen/sdo_server.h"

namespace trn {

/// A whole CANopen servo drive: NMT, heartbeat both ways, guarding, SDO server, PDOs, emergency, CiA 402, and
/// what can go wrong with it. Pure: frames and time in, frames out; on a virtual bus or a real one.
class EmulatedNode {
 public:
  struct Config {
    int id = 1;
    ObjectDictionary dictionary;
    EmulatedDrive::Config drive;
    unsigned sync_periods_max = 5;  ///< without SYNC: the drive faults
    bool fd = false;                ///< PDOs in CAN FD frames
    PdoHabits pdo_habits = {};
    std::uint32_t serial = 0;  ///< of its identity; 0: the data sheet's
    bool without_id = false;   ///< nobody has given it its node id yet
    bool stores = true;        ///< what it is told to, by LSS and by 0x1010; false: it refuses
    int bitrate = 0;           ///< of the bus; 0: one that the node does not know by number
    std::int64_t answer_delay_ns =
        20'000;  ///< from a SYNC or a request to the frame's way into the controller
  };
  /// What goes wrong, by tests and scripts; `value` as each says.
  enum class Trouble : std::uint8_t {
    kSilent,          ///< sends nothing (value 0: again)
    kReset,           ///< off and on
    kEmergency,       ///< emergency message with code `value`, goes on working
    kFault,           ///< fault with code `value`
    kNoHeartbeat,     ///< and no answer to guarding; value 0: again
    kHeartbeatLate,   ///< the next heartbeat comes `value` us late
    kDrop,            ///< leaves Operation Enabled
    kDuplicate,       ///< every TPDO twice (value 0: no more)
    kReorder,         ///< TPDOs swapped with those of the SYNC before (value 0: no more)
    kShortPdo,        ///< TPDOs a byte short (value 0: no more)
    kRefuse,          ///< SDO of object `value` aborts; 0: none
    kSlow,            ///< answers `value` us late
    kLie,             ///< position off by `value` counts
    kPreOperational,  ///< leaves the operational state
    kIgnore,          ///< does not follow its target (value 0: follows again)
    kQuietFault,      ///< fault with code `value`, without an emergency message
    kHeld,            ///< the axis is held fast (value 0: it is free again)
    kSto,             ///< Safe Torque Off takes its torque (value 0: no more)
    kInputs,          ///< the bits of 0x60FD that are on are now `value`
  };

  explicit EmulatedNode(const Config& config);

  void receive(const CanFrame& frame, std::int64_t now_ns);
  void poll(std::int64_t now_ns);
  /// The next frame that is ready by `now_ns`.
  bool next_frame(std::int64_t now_ns, CanFrame& frame);
  void trouble(Trouble kind, std::int64_t value, std::int64_t now_ns);

  /// On a real interface answers take their own time.
  void no_answer_delay() { config_.answer_delay_ns = 0; }
  /// As the config has it; what it has on the bus is `active_id`, lss::kNoNodeId: none yet.
  int id() const { return config_.id; }
  int active_id() const { return id_; }
  NmtState nmt() const { return nmt_; }
  EmulatedDrive& drive() { return drive_; }
  ObjectStore& store() { return store_; }
  /// Targets taken from RPDOs at each SYNC while enabled, for tests that compare bits.
  std::int32_t target_counts() const;

 private:
  struct MappedPdo {
    std::uint32_t id = 0;
    unsigned transmission = 1, size = 0, count = 0;
    bool pending = false;
    std::array<std::uint8_t, 64> data{};
    std::vector<std::pair<std::vector<std::uint8_t>*, unsigned>> fields;  // value, bytes
  };

  void put(const CanFrame& frame, std::int64_t now_ns);
  void obey_nmt(NmtCommand command, std::int64_t now_ns);
  void boot(std::int64_t now_ns, bool power);
  void map_pdos();
  MappedPdo map_pdo(std::uint16_t record);
  void take_rpdo(const CanFrame& frame);
  void on_sync(std::int64_t now_ns);
  void send_tpdo(MappedPdo& pdo, std::int64_t now_ns);
  void watch_master(std::int64_t now_ns);
  EmulatedLss::Config lss_config() const;
  void take_id(int id);
  bool is_deaf() const;
  void beat(std::int64_t now_ns);
  void step_drive(std::int64_t now_ns);

  Config config_;
  ObjectStore store_;
  EmulatedDrive drive_;
  SdoServer sdo_;
  EmulatedLss lss_;
  int id_ = lss::kNoNodeId;
  int bitrate_ = -1;  ///< as a number of the standard's table, since power-on; -1: that of the bus
  NmtState nmt_ = NmtState::kBootUp;
  FrameQueue out_{1000}, answers_{200};
  std::vector<MappedPdo> rpdos_, tpdos_;
  std::int64_t next_beat_ns_ = 0, master_seen_ns_ = 0, last_step_ns_ = 0, last_sync_ns_ = 0;
  std::int64_t guard_seen_ns_ = 0;
  bool renamed_ = false;  ///< it has had another node id than the config's
  bool booted_ = false, master_known_ = false, guarded_ = false, guard_toggle_ = false;
  bool silent_ = false, no_heartbeat_ = false, duplicate_ = false, reorder_ = false, short_ = false;
  std::int64_t slow_ns_ = 0, lie_ = 0;
  CanFrame held_back_;
};

}  // namespace trn
