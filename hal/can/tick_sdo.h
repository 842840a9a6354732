#pragma once

#include <cstdint>

#include "core/realtime.h"
#include "hal/can/frame.h"
#include "hal/can/sdo.h"

namespace trn {

/// Expedited SDO transfers out of the tick, one at a time, for the few objects that a drive does not take in
/// a PDO (CiA 301, 7.2.4.3). Bounded: it holds one frame, and a drive that does not answer within
/// `timeout_periods` is given up.
class TickSdo {
 public:
  enum class State : std::uint8_t { kIdle, kBusy, kDone, kRefused, kSilent };

  TickSdo(int node, std::uint32_t timeout_periods) : node_(node), timeout_periods_(timeout_periods) {}

  /// Only while it is not busy. `bytes`: 1, 2 or 4.
  void read(ObjectKey key) TRN_RT;
  void write(ObjectKey key, std::uint32_t value, int bytes) TRN_RT;
  /// An answer; frames of other transfers are left alone.
  void receive(const CanFrame& frame) TRN_RT;
  /// Once a period; true: `frame` has to be sent.
  bool step(CanFrame& frame) TRN_RT;
  void forget() TRN_RT { state_ = State::kIdle; }

  State state() const TRN_RT { return state_; }
  bool busy() const TRN_RT { return state_ == State::kBusy; }
  ObjectKey key() const TRN_RT { return key_; }
  bool reads() const TRN_RT { return reads_; }
  /// Of a finished read, as many bytes as the drive sent.
  std::uint32_t value() const TRN_RT { return value_; }

 private:
  void begin(ObjectKey key, std::uint8_t command, std::uint32_t value) TRN_RT;

  int node_;
  std::uint32_t timeout_periods_, periods_ = 0;
  State state_ = State::kIdle;
  ObjectKey key_;
  CanFrame request_;
  std::uint32_t value_ = 0;
  bool reads_ = false, unsent_ = false;
};

}  // namespace trn
