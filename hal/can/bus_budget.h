#pragma once

#include <string>
#include <vector>

#include "hal/can/frame.h"

namespace trn {

/// Bits that a classic data frame with `bytes` data bytes takes at most, stuff bits and the pause behind it
/// included: 8n + 47 + floor((34 + 8n - 1) / 4) with an 11-bit identifier, 8n + 67 + floor((54 + 8n - 1) / 4)
/// with 29 bits (ISO 11898-1; Davis, Burns, Bril, Lukkien 2007, eq. 1).
int worst_frame_bits(int bytes, bool extended = false) TRN_RT;
/// Bits of this very frame, its stuff bits counted, the pause included.
int frame_bits(const CanFrame& frame);
/// Time of an FD frame with 11-bit identifier and bit-rate switch, at most, s (ISO 11898-1: dynamic stuffing
/// up to the data, fixed stuff bits in the CRC field).
double worst_fd_frame_s(int bytes, double bitrate, double data_bitrate) TRN_RT;

/// Time of this frame at most, s; FD frames with bit-rate switch.
double worst_frame_s(const CanFrame& frame, double bitrate, double data_bitrate) TRN_RT;

/// What a bus has to carry, and whether it can.
struct BusBudget {
  struct Item {
    std::string what;
    int frames = 0;  ///< in the cycle
    int bytes = 0;   ///< data bytes of each
    double cycle_s = 0;
    bool fd = false;
  };

  std::string bus;
  double bitrate = 0;
  double period_s = 0;
  std::vector<Item> items;
  double data_bitrate = 0;  ///< of the data of FD frames

  /// One frame of it at most, s.
  double frame_s(const Item& item) const;
  /// The longest frame that may be on the bus, of services too, s.
  double longest_frame_s() const;
  /// Cyclic load in a period: every item with its worst frames, those slower than the period by their share.
  double cyclic_s() const;
  /// Cyclic load, and one longest frame that may just have begun.
  double needed_s() const;
  double load() const { return cyclic_s() / period_s; }
  bool fits() const { return needed_s() <= period_s; }
  /// The smallest whole number of ms that would do, s.
  double smallest_period_s() const;
  /// The sum, item by item.
  std::string arithmetic() const;
};

}  // namespace trn
