#include "sim/canopen/sdo_server.h"

#include <algorithm>
#include <array>

#include "core/check.h"
#include "hal/can/nmt.h"

namespace trn {

namespace {
constexpr std::size_t kSegment = 7, kStoreMax = 1 << 16;
constexpr int kBlock = 127;
}  // namespace

void SdoServer::answer(std::initializer_list<std::uint8_t> head, std::span<const std::uint8_t> rest) {
  std::array<std::uint8_t, 8> bytes{};
  TRN_CHECK(head.size() >= 1 && head.size() + rest.size() <= 8);
  std::copy(head.begin(), head.end(), bytes.begin());
  std::copy_n(rest.begin(), std::min(rest.size(), 8 - head.size()),
              bytes.begin() + static_cast<std::ptrdiff_t>(head.size()));
  answers_->push(make_frame(cob::kSdoAnswer + static_cast<unsigned>(node_), bytes));
}

void SdoServer::abort(std::uint32_t code) {
  mode_ = Mode::kIdle;
  std::array<std::uint8_t, 4> bytes;
  put_le(bytes.data(), 4, code);
  answer({0x80, static_cast<std::uint8_t>(key_.index), static_cast<std::uint8_t>(key_.index >> 8), key_.sub},
         bytes);
}

void SdoServer::receive(const CanFrame& frame, FrameQueue& answers) {
  if (frame.size != 8 || frame.id != cob::kSdoRequest + static_cast<unsigned>(node_) || frame.remote) return;
  answers_ = &answers;
  const unsigned command = frame.data[0];
  if (command == 0x80) return reset();
  // Inside a block the first byte is a number and no command, so this is asked before commands are told
  // apart.
  if (mode_ == Mode::kBlockDownload) return take_block_segment(frame);
  const unsigned specifier = command >> 5;
  const bool initiates = specifier == 1 || specifier == 2 || (specifier == 6 && (command & 1) == 0) ||
                         (specifier == 5 && (command & 3) == 0);
  if (initiates) key_ = {static_cast<std::uint16_t>(get_le(frame.data.data() + 1, 2)), frame.data[3]};
  switch (specifier) {
    case 0:
      return take_segment(frame);
    case 1:
      return start_download(frame);
    case 2:
      return start_upload();
    case 3:
      return give_segment(frame);
    case 5:
      return block_upload(frame);
    case 6:
      return (command & 1) ? end_block_download(frame) : start_block_download(frame);
    default:
      return abort(sdo_abort::kCommand);
  }
}

std::uint32_t SdoServer::load() {
  // A fault that a script has asked for: the object exists, and this drive refuses it.
  if (refused_code_ != 0 && key_.index == refused_index_) return refused_code_;
  position_ = 0;
  toggle_ = false;
  return store_.read(key_, data_);
}

void SdoServer::store() {
  mode_ = Mode::kIdle;
  const bool refused = refused_code_ != 0 && key_.index == refused_index_;
  const std::uint32_t code = refused ? refused_code_ : store_.write(key_, data_);
  if (code != 0) return abort(code);
  written_(key_);
}

void SdoServer::start_download(const CanFrame& frame) {
  const unsigned command = frame.data[0];
  const auto low = static_cast<std::uint8_t>(key_.index), high = static_cast<std::uint8_t>(key_.index >> 8);
  if (command & 2) {
    const std::size_t size = command & 1 ? 4 - (command >> 2 & 3) : 4;
    data_.assign(frame.data.begin() + 4, frame.data.begin() + 4 + static_cast<std::ptrdiff_t>(size));
    // An abort is an answer as well: where one has been put, the confirmation is left out.
    const std::size_t before = answers_->size();
    store();
    if (answers_->size() == before) answer({0x60, low, high, key_.sub});
    return;
  }
  data_.clear();
  toggle_ = false;
  mode_ = Mode::kDownload;
  answer({0x60, low, high, key_.sub});
}

void SdoServer::take_segment(const CanFrame& frame) {
  if (mode_ != Mode::kDownload) return abort(sdo_abort::kCommand);
  const unsigned command = frame.data[0];
  if (((command & 0x10) != 0) != toggle_) return abort(sdo_abort::kToggle);
  const std::size_t size = kSegment - (command >> 1 & 7);
  data_.insert(data_.end(), frame.data.begin() + 1,
               frame.data.begin() + 1 + static_cast<std::ptrdiff_t>(size));
  if (data_.size() > kStoreMax) return abort(sdo_abort::kMemory);
  const std::size_t before = answers_->size();
  if (command & 1) store();
  if (answers_->size() == before) answer({static_cast<std::uint8_t>(0x20 | (toggle_ ? 0x10 : 0))});
  toggle_ = !toggle_;
}

void SdoServer::start_upload() {
  if (const std::uint32_t code = load()) return abort(code);
  const auto low = static_cast<std::uint8_t>(key_.index), high = static_cast<std::uint8_t>(key_.index >> 8);
  const std::size_t size = data_.size();
  if (size >= 1 && size <= 4)
    return answer({static_cast<std::uint8_t>(0x43 | (4 - size) << 2), low, high, key_.sub}, data_);
  std::array<std::uint8_t, 4> bytes;
  put_le(bytes.data(), 4, size);
  mode_ = Mode::kUpload;
  answer({0x41, low, high, key_.sub}, bytes);
}

void SdoServer::give_segment(const CanFrame& frame) {
  if (mode_ != Mode::kUpload) return abort(sdo_abort::kCommand);
  TRN_CHECK(position_ <= data_.size());
  if (((frame.data[0] & 0x10) != 0) != toggle_) return abort(sdo_abort::kToggle);
  const std::size_t size = std::min(kSegment, data_.size() - position_);
  const bool last = position_ + size == data_.size();
  const auto command =
      static_cast<std::uint8_t>((toggle_ ? 0x10u : 0u) | (kSegment - size) << 1 | (last ? 1u : 0u));
  answer({command}, std::span(data_).subspan(position_, size));
  position_ += size;
  toggle_ = !toggle_;
  if (last) mode_ = Mode::kIdle;
}

void SdoServer::start_block_download(const CanFrame&) {
  data_.clear();
  mode_ = Mode::kBlockDownload;
  sequence_ = 0;
  // Answer to the request for a block download, with the bit that says that the checksum is known (CiA 301).
  answer({0xA4, static_cast<std::uint8_t>(key_.index), static_cast<std::uint8_t>(key_.index >> 8), key_.sub,
          kBlock});
}

// Segments out of order are left out; the acknowledge names the last good one and the client repeats the
// rest.
void SdoServer::take_block_segment(const CanFrame& frame) {
  const int number = frame.data[0] & 0x7F;
  const bool last = frame.data[0] & 0x80;
  const bool in_order = number == sequence_ + 1;
  TRN_CHECK(sequence_ >= 0 && sequence_ <= kBlock);
  if (in_order) {
    ++sequence_;
    data_.insert(data_.end(), frame.data.begin() + 1, frame.data.begin() + 8);
    if (data_.size() > kStoreMax) return abort(sdo_abort::kMemory);
  }
  if (!last && number != kBlock) return;
  answer({0xA2, static_cast<std::uint8_t>(sequence_), kBlock});
  sequence_ = 0;
  if (last && in_order) mode_ = Mode::kBlockDownloadEnd;
}

void SdoServer::end_block_download(const CanFrame& frame) {
  if (mode_ != Mode::kBlockDownloadEnd) return abort(sdo_abort::kCommand);
  const std::size_t unused = frame.data[0] >> 2 & 7u;
  if (unused > data_.size()) return abort(sdo_abort::kLength);
  data_.resize(data_.size() - unused);
  if (sdo_crc(data_) != get_le(frame.data.data() + 1, 2)) return abort(sdo_abort::kCrc);
  const std::size_t before = answers_->size();
  store();
  if (answers_->size() == before) answer({0xA1});
}

void SdoServer::block_upload(const CanFrame& frame) {
  const unsigned step = frame.data[0] & 3u;
  if (step == 0) {
    if (const std::uint32_t code = load()) return abort(code);
    block_size_ = std::clamp<int>(frame.data[4], 1, kBlock);
    mode_ = Mode::kBlockUpload;
    std::array<std::uint8_t, 4> size;
    put_le(size.data(), 4, data_.size());
    return answer(
        {0xC6, static_cast<std::uint8_t>(key_.index), static_cast<std::uint8_t>(key_.index >> 8), key_.sub},
        size);
  }
  if (mode_ != Mode::kBlockUpload) return step == 1 ? void() : abort(sdo_abort::kCommand);
  if (step == 3) return give_block();
  // The client confirms the end of the transfer.
  if (step == 1) return reset();
  position_ = std::min(block_start_ + kSegment * frame.data[1], data_.size());
  block_size_ = std::clamp<int>(frame.data[2], 1, kBlock);
  if (position_ < data_.size()) return give_block();
  const std::size_t in_last = data_.size() % kSegment;
  // An object without any byte goes as one segment of which all seven bytes are unused.
  const std::size_t unused = in_last == 0 && !data_.empty() ? 0 : kSegment - in_last;
  const std::uint16_t crc = sdo_crc(data_);
  answer({static_cast<std::uint8_t>(0xC1 | unused << 2), static_cast<std::uint8_t>(crc),
          static_cast<std::uint8_t>(crc >> 8)});
}

void SdoServer::give_block() {
  TRN_CHECK(position_ <= data_.size());
  TRN_CHECK(block_size_ >= 1 && block_size_ <= kBlock);
  block_start_ = position_;
  int number = 0;
  do {
    const std::size_t size = std::min(kSegment, data_.size() - position_);
    const bool last = position_ + size == data_.size();
    answer({static_cast<std::uint8_t>(++number | (last ? 0x80 : 0))},
           std::span(data_).subspan(position_, size));
    position_ += size;
  } while (number < block_size_ && position_ < data_.size());
}

}  // namespace trn
