#pragma once

#include <cstdint>

#include "hal/can/frame.h"
#include "hal/can/lss.h"
#include "sim/canopen/frame_queue.h"

namespace trn {

/// The slave's side of the layer setting services (CiA 305), written from the standard, apart from the
/// master.
class EmulatedLss {
 public:
  struct Config {
    LssIdentity identity{};
    int node_id = lss::kNoNodeId;  ///< stored in it
    int bitrate = 0;               ///< stored in it, as an index of the standard's table; -1: that of the bus
    bool stores = true;
  };

  explicit EmulatedLss(const Config& config) : config_(config) { power_cycle(); }

  /// A frame to the slaves, while the node has this id.
  void receive(const CanFrame& frame, int node_id, FrameQueue& answers);
  /// What acts behind a reset of communication.
  int node_id() const { return node_id_; }
  /// What acts behind a loss of power.
  void power_cycle();
  /// Waiting again, behind configuration.
  bool left_configuration();
  int bitrate() const { return bitrate_; }

 private:
  void answer(std::uint8_t command, std::uint64_t value, FrameQueue& answers) const;
  void select(std::uint8_t command, std::uint32_t number, FrameQueue& answers);
  void scan(const CanFrame& frame, FrameQueue& answers);
  void configure(const CanFrame& frame, int node_id, FrameQueue& answers);

  Config config_;
  bool configuration_ = false, left_ = false;
  int node_id_ = lss::kNoNodeId, bitrate_ = 0, selected_ = 0, scan_part_ = 0;
};

}  // namespace trn
