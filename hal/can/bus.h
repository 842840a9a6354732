#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/realtime.h"
#include "hal/can/frame.h"

namespace trn {

enum class BusState : std::uint8_t { kOnline, kBusOff, kDown };

/// Frames that an endpoint wants to hear: (id & mask) == (filter id & mask), 11-bit data frames.
struct CanFilter {
  std::uint32_t id = 0, mask = 0x7FF;
};

/// One listener and speaker on a CAN bus, real or virtual. It does not hear itself. One thread uses an
/// endpoint.
class CanEndpoint {
 public:
  virtual ~CanEndpoint() = default;

  /// Puts frames into the controller's queue, in order; returns how many it took. Never waits.
  virtual int send(std::span<const CanFrame> frames) TRN_RT = 0;
  /// Takes what has come; returns how many, fewer than there is room for only if nothing is left. Never
  /// waits.
  virtual int receive(std::span<CanFrame> frames) TRN_RT = 0;
  /// What the controller last said of itself; brought up to date by send and receive.
  virtual BusState state() const TRN_RT = 0;
  /// Monotonic time of this bus, ns.
  virtual std::int64_t now_ns() const TRN_RT = 0;
  /// When the last own frame had been transmitted, same clock; 0: not known. Needs `confirm_sends`.
  virtual std::int64_t confirmed_ns() const TRN_RT { return 0; }
  /// It carries CAN FD frames.
  virtual bool carries_fd() const { return true; }
  /// Before the first frame: has the controller tell when frames are out.
  virtual void confirm_sends() {}

  /// Outside the tick: waits until a frame is there, or `timeout_ns` has passed.
  virtual void wait(std::int64_t timeout_ns) = 0;
  /// Outside the tick: tries to bring a bus that is off or down to work again; "" or what to do about it.
  virtual std::string recover() = 0;
};

/// Opens endpoints; std::runtime_error with the remedy if the interface cannot be used.
class CanOpener {
 public:
  virtual ~CanOpener() = default;
  virtual std::unique_ptr<CanEndpoint> open(const std::string& interface,
                                            const std::vector<CanFilter>& filters) = 0;
};

}  // namespace trn
