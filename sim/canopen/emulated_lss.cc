#include "sim/canopen/emulated_lss.h"

#include <array>
#include <utility>

namespace trn {

namespace {
constexpr int kBitRatesMax = 8;
constexpr std::uint8_t kOutOfRange = 1, kNotSupported = 1;
}  // namespace

void EmulatedLss::power_cycle() {
  node_id_ = config_.node_id;
  bitrate_ = config_.bitrate;
  configuration_ = left_ = false;
  selected_ = scan_part_ = 0;
}

bool EmulatedLss::left_configuration() { return std::exchange(left_, false); }

void EmulatedLss::answer(std::uint8_t command, std::uint64_t value, FrameQueue& answers) const {
  std::array<std::uint8_t, 8> bytes{};
  bytes[0] = command;
  put_le(bytes.data() + 1, 7, value);
  answers.push(make_frame(lss::kToMaster, bytes));
}

void EmulatedLss::receive(const CanFrame& frame, int node_id, FrameQueue& answers) {
  if (frame.id != lss::kToNode || frame.size != 8 || frame.remote) return;
  const std::uint8_t command = frame.data[0];
  if (command == lss::kSwitchAll) {
    left_ |= configuration_ && frame.data[1] == lss::kWaiting;
    configuration_ = frame.data[1] == lss::kConfiguration;
    selected_ = 0;
  } else if (command >= lss::kSelectVendor && command <= lss::kSelectSerial) {
    select(command, static_cast<std::uint32_t>(get_le(frame.data.data() + 1, 4)), answers);
  } else if (command == lss::kFastScan) {
    // Whoever has a node id does not take part (CiA 305, 6.10).
    if (!configuration_ && node_id == lss::kNoNodeId && node_id_ == lss::kNoNodeId) scan(frame, answers);
  } else if (configuration_) {
    configure(frame, node_id, answers);
  }
}

// The four numbers, in this order
void EmulatedLss::select(std::uint8_t command, std::uint32_t number, FrameQueue& answers) {
  const int part = command - lss::kSelectVendor;
  const bool goes_on = part == selected_ && number == config_.identity[static_cast<std::size_t>(part)];
  selected_ = goes_on ? part + 1 : 0;
  if (selected_ != 4) return;
  selected_ = 0;
  configuration_ = true;
  answer(lss::kSelected, 0, answers);
}

void EmulatedLss::scan(const CanFrame& frame, FrameQueue& answers) {
  const auto number = static_cast<std::uint32_t>(get_le(frame.data.data() + 1, 4));
  const unsigned bits = frame.data[5], part = frame.data[6], next = frame.data[7];
  if (bits == lss::kScanAll) {
    scan_part_ = 0;
    return answer(lss::kFound, 0, answers);
  }
  if (bits > 31 || part > 3 || next > 3 || static_cast<int>(part) != scan_part_) return;
  // Bits below the one that is checked do not matter.
  const std::uint32_t mask = ~std::uint32_t{0} << bits;
  if (((number ^ config_.identity[part]) & mask) != 0) return;
  answer(lss::kFound, 0, answers);
  if (bits != 0 || next == part) return;
  if (next < part) configuration_ = true;
  scan_part_ = static_cast<int>(next);
}

void EmulatedLss::configure(const CanFrame& frame, int node_id, FrameQueue& answers) {
  const std::uint8_t command = frame.data[0], value = frame.data[1];
  if (command == lss::kSetNodeId) {
    const bool legal = (value >= 1 && value <= 127) || value == lss::kNoNodeId;
    if (legal) node_id_ = value;
    answer(command, legal ? 0 : kOutOfRange, answers);
  } else if (command == lss::kSetBitTiming) {
    const std::uint8_t index = frame.data[2];
    const bool legal = value == 0 && index <= kBitRatesMax && index != 5;
    if (legal) bitrate_ = index;
    answer(command, legal ? 0 : kNotSupported, answers);
  } else if (command == lss::kStore) {
    if (config_.stores) {
      config_.node_id = node_id_;
      config_.bitrate = bitrate_;
    }
    answer(command, config_.stores ? 0 : kNotSupported, answers);
  } else if (command >= lss::kAskVendor && command < lss::kAskVendor + 4) {
    answer(command, config_.identity[static_cast<std::size_t>(command - lss::kAskVendor)], answers);
  } else if (command == lss::kAskNodeId) {
    answer(command, static_cast<std::uint64_t>(node_id), answers);
  }
}

}  // namespace trn
