#include "hal/can/tick_sdo.h"

#include "core/check.h"
#include "hal/can/nmt.h"

namespace trn {

namespace {
constexpr std::uint8_t kReadRequest = 0x40, kReadAnswer = 0x40, kWriteAnswer = 0x60, kTransferAborted = 0x80;
constexpr std::uint8_t kWriteExpedited = 0x23;  // of a download; bits 2 and 3: bytes that are not data
}  // namespace

void TickSdo::begin(ObjectKey key, std::uint8_t command, std::uint32_t value) TRN_RT {
  TRN_CHECK(!busy());
  key_ = key;
  request_ = CanFrame{};
  request_.id = cob::kSdoRequest + static_cast<unsigned>(node_);
  request_.size = 8;
  request_.data[0] = command;
  put_le(request_.data.data() + 1, 2, key.index);
  request_.data[3] = key.sub;
  put_le(request_.data.data() + 4, 4, value);
  state_ = State::kBusy;
  periods_ = 0;
  unsent_ = true;
}

void TickSdo::read(ObjectKey key) TRN_RT {
  reads_ = true;
  begin(key, kReadRequest, 0);
}

void TickSdo::write(ObjectKey key, std::uint32_t value, int bytes) TRN_RT {
  TRN_CHECK(bytes == 1 || bytes == 2 || bytes == 4);
  reads_ = false;
  begin(key, static_cast<std::uint8_t>(kWriteExpedited | (4 - bytes) << 2), value);
}

void TickSdo::receive(const CanFrame& frame) TRN_RT {
  if (!busy() || frame.size != 8 || frame.id != cob::kSdoAnswer + static_cast<unsigned>(node_)) return;
  const auto index = static_cast<std::uint16_t>(get_le(frame.data.data() + 1, 2));
  if (index != key_.index || frame.data[3] != key_.sub) return;
  const std::uint8_t command = frame.data[0];
  if (command == kTransferAborted) {
    state_ = State::kRefused;
  } else if (!reads_ && command == kWriteAnswer) {
    state_ = State::kDone;
  } else if (reads_ && (command & 0xE2) == (kReadAnswer | 2)) {
    // Bits 2 and 3 tell the bytes that are no data, if bit 0 says so.
    const int bytes = command & 1 ? 4 - (command >> 2 & 3) : 4;
    value_ = static_cast<std::uint32_t>(get_le(frame.data.data() + 4, bytes));
    state_ = State::kDone;
  }
}

bool TickSdo::step(CanFrame& frame) TRN_RT {
  if (!busy()) return false;
  if (++periods_ > timeout_periods_) {
    state_ = State::kSilent;
    return false;
  }
  if (!unsent_) return false;
  unsent_ = false;
  frame = request_;
  return true;
}

}  // namespace trn
