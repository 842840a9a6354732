#pragma once

#include <cstdint>

#include "core/realtime.h"

namespace trn {

/// A spring-set holding brake: when its output is on, when the axis may move, when the drive may let go.
/// Closed without power. An axis is handed from the brake to the drive and back: one of the two always holds
/// it. Pure.
class Brake {
 public:
  struct Config {
    bool fitted = false;
    bool of_drive = true;   ///< the output is a bit of 0x60FE; else one of [io]
    int output = 0;         ///< that bit, or number of the output
    bool inverted = false;  ///< the output is off when the brake is released
    std::uint32_t release_periods = 0, close_periods = 0;  ///< from the output to the brake itself
    std::uint32_t stop_periods_max = 0;                    ///< of a quick stop; then it closes, moving or not
  };
  struct Input {
    bool held = false;    ///< the drive holds the axis by its torque
    bool stands = false;  ///< it does not move
    bool wanted = false;  ///< the drive is to go on holding it
  };

  explicit Brake(const Config& config) : config_(config) {}

  void step(const Input& input) TRN_RT;

  /// The output, as it goes out.
  bool output() const TRN_RT { return released() != config_.inverted; }
  bool released() const TRN_RT { return state_ == State::kOpening || state_ == State::kOpen; }
  /// The axis may move.
  bool open() const TRN_RT { return !config_.fitted || state_ == State::kOpen; }
  /// The brake holds the axis alone.
  bool holds() const TRN_RT { return !config_.fitted || state_ == State::kClosed; }
  const Config& config() const TRN_RT { return config_; }

 private:
  enum class State : std::uint8_t { kClosed, kOpening, kOpen, kClosing };
  void enter(State state) TRN_RT {
    state_ = state;
    periods_ = 0;
  }

  Config config_;
  State state_ = State::kClosed;
  std::uint32_t periods_ = 0;   ///< in the state
  std::uint32_t unwanted_ = 0;  ///< periods since the drive was told to stop
};

}  // namespace trn
