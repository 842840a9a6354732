#pragma once

#include <cstdint>

#include "core/realtime.h"

namespace trn {

/// The touch probe 1 of one drive (CiA 402-2, objects 0x60B8 to 0x60BB): waits for one change of its input
/// and takes the position there. Pure; told of every PDO.
class Cia402Touch {
 public:
  void arm(bool contact) TRN_RT;
  void disarm() TRN_RT { phase_ = Phase::kIdle; }

  /// 0x60B8, what the drive is told.
  std::uint16_t function() const TRN_RT;
  /// Takes the status of the probe (0x60B9) and the position that the drive has latched: 0x60BA where the
  /// contact closed (`contact`), 0x60BB where it opened. The status goes first, since a position counts only
  /// when the status has told of it.
  void take_status(std::uint16_t status) TRN_RT;
  void take_position(bool contact, std::int32_t counts) TRN_RT;

  bool contact_wanted() const TRN_RT { return contact_; }
  bool armed() const TRN_RT { return phase_ >= Phase::kArmed; }
  /// The drive has seen the change.
  bool triggered() const TRN_RT { return phase_ >= Phase::kTriggered; }
  /// `counts` is where.
  bool latched() const TRN_RT { return phase_ == Phase::kLatched; }
  std::int32_t counts() const TRN_RT { return counts_; }

 private:
  enum class Phase : std::uint8_t { kIdle, kClearing, kArming, kArmed, kTriggered, kLatched };

  Phase phase_ = Phase::kIdle;
  bool contact_ = true;
  std::int32_t counts_ = 0;
};

}  // namespace trn
