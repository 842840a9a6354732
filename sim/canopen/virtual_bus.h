#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hal/can/bus.h"
#include "hal/can/frame.h"
#include "sim/canopen/emulated_node.h"
#include "sim/canopen/frame_queue.h"

namespace trn {

/// A CAN bus in memory, with its own time: one frame at a time, the lowest identifier first, each as long as
/// its bits take. Deterministic; one thread.
class VirtualBus {
 public:
  explicit VirtualBus(double bitrate, double data_bitrate = 0)
      : bitrate_(bitrate), data_bitrate_(data_bitrate) {}
  ~VirtualBus();
  VirtualBus(const VirtualBus&) = delete;
  VirtualBus& operator=(const VirtualBus&) = delete;

  void add(EmulatedNode& node);
  std::unique_ptr<CanEndpoint> open(const std::vector<CanFilter>& filters);
  /// Lets the bus and its nodes work until `time_ns`.
  void run_until(std::int64_t time_ns);
  std::int64_t now_ns() const { return now_ns_; }

  /// Frames of nobody in particular, as a fuzzer or a second master sends them.
  void inject(const CanFrame& frame) { foreign_.push(frame); }
  /// The master's controller goes off the bus, or its interface down, and stays so until `kOnline`.
  /// `repairable`: a reset brings it back.
  void set_state(BusState state, bool repairable = false);
  /// The controller's queue is full and stays so: nothing is taken, as by a driver that says ENOBUFS.
  void jam(bool jammed) { jammed_ = jammed; }
  /// Called with every frame that was transmitted, at its end.
  void on_frame(std::function<void(const CanFrame&)> listener) { listener_ = std::move(listener); }

  std::uint64_t frames() const { return frames_; }
  std::int64_t busy_ns() const { return busy_ns_; }

 private:
  class Endpoint;
  struct Sender;

  bool pick(CanFrame& frame, Endpoint*& sender);
  void deliver(const CanFrame& frame, Endpoint* sender);
  std::int64_t duration_ns(const CanFrame& frame) const;
  void poll_nodes();

  double bitrate_, data_bitrate_;
  std::int64_t now_ns_ = 0, busy_ns_ = 0, end_ns_ = 0, next_poll_ns_ = 0;
  std::uint64_t frames_ = 0;
  std::vector<EmulatedNode*> nodes_;
  std::vector<FrameQueue> node_queues_;
  std::vector<Endpoint*> endpoints_;
  FrameQueue foreign_{4096};
  CanFrame current_;
  Endpoint* current_sender_ = nullptr;
  bool in_flight_ = false, repairable_ = false, jammed_ = false;
  BusState state_ = BusState::kOnline;
  std::function<void(const CanFrame&)> listener_;
};

}  // namespace trn
