#include "hal/can/bus_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trn {

namespace {

/// Counts a frame's bits from start to the CRC sequence, with a stuff bit after every five equal ones.
class BitCounter {
 public:
  void add(std::uint32_t value, int bits) {
    for (int i = bits - 1; i >= 0; --i) add_bit(value >> i & 1u, true);
  }
  void add_crc() {  // CRC-15 of CAN: x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1
    const std::uint32_t crc = crc_;
    for (int i = 14; i >= 0; --i) add_bit(crc >> i & 1u, false);
  }
  int bits() const { return bits_; }

 private:
  void add_bit(std::uint32_t bit, bool into_crc) {
    if (into_crc) {
      const bool invert = bit ^ (crc_ >> 14 & 1u);
      crc_ = (crc_ << 1 & 0x7FFFu) ^ (invert ? 0x4599u : 0u);
    }
    put(bit);
    // A stuff bit is not part of the CRC, but begins a new run of equal bits.
    if (run_ == 5) put(last_ ^ 1u);
  }
  void put(std::uint32_t bit) {
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    ++bits_;
  }

  std::uint32_t crc_ = 0, last_ = 2;
  int run_ = 0, bits_ = 0;
};

constexpr int kUnstuffedTail = 10 + 3;  // CRC delimiter, acknowledge, end of frame; pause

}  // namespace

int worst_frame_bits(int bytes, bool extended) TRN_RT {
  // Stuff bits come after five equal bits, and the stuff bit itself may begin the next five: at worst one
  // every four bits (Davis and others, equation 1).
  const int data = 8 * bytes;
  return extended ? data + 67 + (54 + data - 1) / 4 : data + 47 + (34 + data - 1) / 4;
}

int frame_bits(const CanFrame& frame) {
  BitCounter counter;
  counter.add(0, 1);  // start of frame
  const std::uint32_t remote = frame.remote ? 1 : 0;
  if (frame.extended) {
    counter.add(frame.id >> 18, 11);
    counter.add(3, 2);  // substitute remote request, identifier extension
    counter.add(frame.id & 0x3FFFF, 18);
    counter.add(remote << 2, 3);
  } else {
    counter.add(frame.id, 11);
    counter.add(remote << 2, 3);
  }
  counter.add(frame.size, 4);
  for (int i = 0; i < frame.size && !frame.remote; ++i)
    counter.add(frame.data[static_cast<std::size_t>(i)], 8);
  counter.add_crc();
  return counter.bits() + kUnstuffedTail;
}

double worst_fd_frame_s(int bytes, double bitrate, double data_bitrate) TRN_RT {
  const int crc = bytes <= 16 ? 17 : 21;
  const int slow_head = 17 + 17 / 4;    // start, identifier, r1, IDE, FDF, res, BRS
  const int slow_tail = 12 + 3;         // CRC delimiter, acknowledge, end of frame; pause
  const int fast_data = 5 + 8 * bytes;  // ESI, length, data
  const int fast_crc =
      4 + crc + (4 + crc) / 4 + 1;  // stuff count, CRC and a fixed stuff bit before every four
  return (slow_head + slow_tail) / bitrate + (fast_data + fast_data / 4 + fast_crc) / data_bitrate;
}

double worst_frame_s(const CanFrame& frame, double bitrate, double data_bitrate) TRN_RT {
  if (frame.fd && data_bitrate > 0) return worst_fd_frame_s(frame.size, bitrate, data_bitrate);
  return worst_frame_bits(frame.remote ? 0 : frame.size, frame.extended) / bitrate;
}

double BusBudget::frame_s(const Item& item) const {
  return item.fd ? worst_fd_frame_s(item.bytes, bitrate, data_bitrate)
                 : worst_frame_bits(item.bytes) / bitrate;
}

double BusBudget::longest_frame_s() const {
  // Eight bytes at least: SDO frames are never shorter, though no item of the list names them.
  double longest = worst_frame_bits(8) / bitrate;
  for (const Item& item : items) longest = std::max(longest, frame_s(item));
  return longest;
}

double BusBudget::cyclic_s() const {
  double sum = 0;
  for (const Item& item : items) sum += item.frames * frame_s(item) * (period_s / item.cycle_s);
  return sum;
}

// CAN does not interrupt a frame that is under way. Whatever just began when SYNC is due delays the whole
// period by its length.
double BusBudget::needed_s() const { return cyclic_s() + longest_frame_s(); }

double BusBudget::smallest_period_s() const {
  BusBudget longer = *this;
  for (int ms = 1; ms <= 1000; ++ms) {
    longer.period_s = 1e-3 * ms;
    // Items of one to ten periods are PDOs and grow with the period; slower ones are heartbeats, whose time
    // is fixed in ms.
    for (std::size_t i = 0; i < items.size(); ++i)
      longer.items[i].cycle_s =
          items[i].cycle_s * (items[i].cycle_s < 10.5 * period_s ? longer.period_s / period_s : 1);
    if (longer.fits()) return longer.period_s;
  }
  return 0;
}

std::string BusBudget::arithmetic() const {
  std::string text;
  for (const Item& item : items) {
    const double time_us = 1e6 * item.frames * frame_s(item);
    const std::string size = item.fd ? fmt::format("{:>2} bytes FD", item.bytes)
                                     : fmt::format("{:>3} bits    ", worst_frame_bits(item.bytes));
    const bool every_period = std::abs(item.cycle_s - period_s) < 1e-9;
    text += fmt::format("  {:<34} {:>2} x {} = {:>6.1f} us{}\n", item.what, item.frames, size, time_us,
                        every_period ? ""
                                     : fmt::format(" every {:g} ms: {:.1f} us a period", 1000 * item.cycle_s,
                                                   time_us * period_s / item.cycle_s));
  }
  text += fmt::format("  {:<53} = {:>6.1f} us\n", "one longest frame in the way", 1e6 * longest_frame_s());
  return text + fmt::format("  together {:.1f} us of {:g} us ({:.1f} %)", 1e6 * needed_s(), 1e6 * period_s,
                            100 * needed_s() / period_s);
}

}  // namespace trn
