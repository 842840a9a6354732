#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/fault.h"
#include "core/time_histogram.h"
#include "hal/can/bus.h"
#include "hal/can/can_config.h"
#include "hal/can/frame.h"
#include "hal/can/node_link.h"

namespace trn {

/// The master of one bus in the tick: hears everybody, sends SYNC, setpoints and its heartbeat. CiA 301, 7.2.
class CanMaster {
 public:
  struct Config {
    double period_s = 0;
    int master_id = 127, sync_counter = 0;
    std::uint32_t heartbeat_periods = 0, overload_max = 3;
    CanBusConfig bus;
  };
  /// What other threads may know.
  struct Statistics {
    TimeHistogram sync_jitter;  ///< distance of a SYNC from one period after the last one
    TimeHistogram bus_latency;  ///< from the setpoints' sending to the end of their last frame on the bus
    std::atomic<std::uint64_t> wire_ns = 0;  ///< of all frames heard and sent, at their worst length
    std::atomic<std::uint64_t> sent = 0, received = 0, unsent = 0, error_reports = 0;
    std::atomic<std::uint64_t> periods = 0;
  };

  explicit CanMaster(const Config& config);

  /// The endpoint to use from now on; the tick only. It hears what the one before still had to send, that of
  /// a process that is gone as well: until its own frames are out, nobody else is blamed for those.
  void attach(CanEndpoint* endpoint) TRN_RT;
  CanEndpoint* endpoint() const TRN_RT { return endpoint_; }

  void receive() TRN_RT;
  /// After the nodes' steps; everything of this period in one call to the bus.
  void send() TRN_RT;
  void reset() TRN_RT;
  /// Filters for the tick's endpoint, and for the one that sets nodes up.
  std::vector<CanFilter> tick_filters() const;
  std::vector<CanFilter> service_filters() const;

  std::vector<NodeLink>& nodes() TRN_RT { return nodes_; }
  const std::vector<NodeLink>& nodes() const TRN_RT { return nodes_; }
  const Config& config() const TRN_RT { return config_; }
  const Statistics& statistics() const { return *statistics_; }
  /// Fault of the bus as a whole.
  Fault fault() const TRN_RT { return fault_; }
  std::string health() const;
  /// Share of the bus' time that the frames heard and sent take at their worst length, since it was opened.
  double measured_load() const;

 private:
  static constexpr std::size_t kBatch = 64;
  // What is heard while drives are set up must be over before they are watched: a hundred answers of each.
  static constexpr int kBatchesPerTick = 32;
  // A controller sends in the order in which it was told, some with a few frames in hand by their
  // identifiers. Two whole periods of the new endpoint are on the bus behind everything that the old one had
  // queued.
  static constexpr int kOwnPeriods = 2;
  static constexpr std::size_t kFramesMax = 2 + NodeLink::kFramesMax * kNodesMax;

  void take(const CanFrame& frame) TRN_RT;
  void count_time(const CanFrame& frame) TRN_RT;
  bool is_foreign(const CanFrame& frame) const TRN_RT;
  void watch_bus() TRN_RT;
  void lose_nodes(Fault fault) TRN_RT;
  std::size_t collect() TRN_RT;

  Config config_;
  std::vector<NodeLink> nodes_;
  CanEndpoint* endpoint_ = nullptr;
  std::array<CanFrame, kBatch> in_;
  std::array<CanFrame, kFramesMax> out_;
  std::unique_ptr<Statistics> statistics_;
  Fault fault_ = Fault::kOk;
  int counter_ = 0;
  int own_periods_ = 0;  ///< that a new endpoint still has to confirm before foreign frames count
  std::uint32_t since_heartbeat_ = 0, overloaded_ = 0;
  std::int64_t last_sync_ns_ = 0;
};

}  // namespace trn
