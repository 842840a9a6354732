#include "hal/can/sdo.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace trn {

namespace {

constexpr int kIdleAcks = 3;         // blocks of which the node has taken nothing, one after the other
constexpr int kBlockSegments = 127;  // the most a block may have
constexpr std::size_t kSegmentBytes = 7;

// Command bytes of the client, CiA 301, 7.2.4.3
constexpr std::uint8_t kInitiateDownload = 0x20, kInitiateUpload = 0x40, kUploadSegmentRequest = 0x60;
constexpr std::uint8_t kAbort = 0x80, kBlockUploadRequest = 0xA0, kBlockDownloadRequest = 0xC0;
constexpr std::uint8_t kCrcSupported = 0x04, kSizeIndicated = 0x02;

std::uint32_t word_at(const CanFrame& frame, int offset) {
  return static_cast<std::uint32_t>(get_le(frame.data.data() + offset, 4));
}

}  // namespace

std::string to_string(ObjectKey key, bool always_sub) {
  if (key.sub == 0 && !always_sub) return fmt::format("0x{:04X}", key.index);
  return fmt::format("0x{:04X}:{}", key.index, key.sub);
}

std::string_view sdo_abort_text(std::uint32_t code) {
  using Row = std::pair<std::uint32_t, std::string_view>;
  static constexpr Row kTexts[] = {
      {0x05030000, "toggle bit not alternated"},
      {0x05040000, "no answer in time"},
      {0x05040001, "command not known"},
      {0x05040002, "block size not legal"},
      {0x05040003, "sequence number not legal"},
      {0x05040004, "checksum of the block wrong"},
      {0x05040005, "out of memory"},
      {0x06010000, "access not supported"},
      {0x06010001, "object can only be written"},
      {0x06010002, "object can only be read"},
      {0x06020000, "object does not exist"},
      {0x06040041, "object cannot be mapped to the PDO"},
      {0x06040042, "mapped objects are longer than the PDO"},
      {0x06040043, "parameters do not fit together"},
      {0x06040047, "devices do not fit together"},
      {0x06060000, "access failed by a hardware error"},
      {0x06070010, "length of the value does not fit the object"},
      {0x06070012, "value too long"},
      {0x06070013, "value too short"},
      {0x06090011, "sub-index does not exist"},
      {0x06090030, "value out of range"},
      {0x06090031, "value too large"},
      {0x06090032, "value too small"},
      {0x06090036, "maximum less than minimum"},
      {0x060A0023, "resource not available"},
      {0x08000000, "general error"},
      {0x08000020, "value cannot be stored"},
      {0x08000021, "value cannot be stored because of local control"},
      {0x08000022, "value cannot be stored in this state of the device"},
      {0x08000023, "no object dictionary"},
      {0x08000024, "no data available"},
  };
  for (const auto& [known, text] : kTexts)
    if (known == code) return text;
  return "code of the manufacturer";
}

std::uint16_t sdo_crc(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<unsigned>(byte) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000u) ? (crc << 1) ^ 0x1021u : crc << 1;
  }
  return static_cast<std::uint16_t>(crc);
}

void SdoClient::begin(ObjectKey key, Phase phase, std::int64_t now_ns) {
  key_ = key;
  phase_ = phase;
  state_ = State::kBusy;
  out_.clear();
  sent_ = block_start_ = 0;
  idle_acks_ = 0;
  toggle_ = aborted_by_node_ = sequence_broken_ = last_seen_ = false;
  abort_code_ = announced_ = 0;
  deadline_ns_ = now_ns + config_.timeout_ns;
}

void SdoClient::put(std::span<const std::uint8_t> bytes) {
  std::array<std::uint8_t, 8> full{};
  std::copy_n(bytes.begin(), std::min<std::size_t>(bytes.size(), 8), full.begin());
  out_.push_back(make_frame(0x600u + static_cast<unsigned>(config_.node), full));
}

void SdoClient::put_initiate(std::uint8_t command, std::uint32_t value) {
  std::array<std::uint8_t, 8> bytes{command, static_cast<std::uint8_t>(key_.index),
                                    static_cast<std::uint8_t>(key_.index >> 8), key_.sub};
  put_le(bytes.data() + 4, 4, value);
  put(bytes);
}

void SdoClient::read(ObjectKey key, std::int64_t now_ns) {
  begin(key, config_.block_upload ? Phase::kBlockUpload : Phase::kUpload, now_ns);
  data_.clear();
  if (config_.block_upload)
    put_initiate(kBlockUploadRequest | kCrcSupported, kBlockSegments);
  else
    put_initiate(kInitiateUpload, 0);
}

void SdoClient::write(ObjectKey key, std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  const bool block = config_.block_from > 0 && bytes.size() >= config_.block_from;
  begin(key, block ? Phase::kBlockDownload : Phase::kDownload, now_ns);
  data_.assign(bytes.begin(), bytes.end());
  const auto size = static_cast<std::uint32_t>(data_.size());
  // The three ways of CiA 301, 7.2.4.3: by block for long data, in the request itself up to 4 bytes, and else
  // in segments of 7 bytes.
  if (block) return put_initiate(kBlockDownloadRequest | kCrcSupported | kSizeIndicated, size);
  const bool expedited = size >= 1 && size <= 4;
  if (!expedited) return put_initiate(kInitiateDownload | 0x01, size);
  sent_ = size;
  const auto unused = static_cast<std::uint8_t>((4 - size) << 2);
  put_initiate(kInitiateDownload | 0x03 | unused,
               static_cast<std::uint32_t>(get_le(data_.data(), static_cast<int>(size))));
}

void SdoClient::fail(std::uint32_t code) {
  out_.clear();
  abort_code_ = code;
  // The node must hear it too. It would otherwise wait for the next segment and refuse the next transfer.
  put_initiate(kAbort, code);
  end(State::kAborted);
}

bool SdoClient::names_our_object(const CanFrame& frame) const {
  return get_le(frame.data.data() + 1, 2) == key_.index && frame.data[3] == key_.sub;
}

void SdoClient::receive(const CanFrame& frame, std::int64_t now_ns) {
  const bool ours = !frame.error && !frame.remote && !frame.extended && frame.size == 8 &&
                    frame.id == 0x580u + static_cast<unsigned>(config_.node);
  if (!ours || state_ != State::kBusy) return;
  // An abort of another object is left over from an earlier transfer that was given up here while the node's
  // answer was under way.
  if (frame.data[0] == kAbort && names_our_object(frame)) {  // no segment of a block has the number 0
    abort_code_ = word_at(frame, 4);
    aborted_by_node_ = true;
    out_.clear();
    return end(State::kAborted);
  }
  deadline_ns_ = now_ns + config_.timeout_ns;
  answer(frame);
}

void SdoClient::answer(const CanFrame& frame) {
  switch (phase_) {
    case Phase::kDownload:
      return on_download(frame);
    case Phase::kDownloadSegment:
      return on_download_segment(frame);
    case Phase::kUpload:
      return on_upload(frame);
    case Phase::kUploadSegment:
      return on_upload_segment(frame);
    case Phase::kBlockDownload:
      return on_block_download(frame);
    case Phase::kBlockDownloadAck:
      return on_block_ack(frame);
    case Phase::kBlockDownloadEnd:
      return frame.data[0] == 0xA1 ? end(State::kDone) : fail(sdo_abort::kCommand);
    case Phase::kBlockUpload:
      return on_block_upload(frame);
    case Phase::kBlockUploadData:
      return on_block_data(frame);
    case Phase::kBlockUploadEnd:
      return on_block_end(frame);
  }
}

void SdoClient::on_download(const CanFrame& frame) {
  if (frame.data[0] != 0x60 || !names_our_object(frame)) return fail(sdo_abort::kCommand);
  // The expedited request had all of the data. An object of no bytes still gets one segment, which says that
  // it is the last.
  if (sent_ == data_.size() && !data_.empty()) return end(State::kDone);
  phase_ = Phase::kDownloadSegment;
  put_download_segment();
}

// Download SDO segment, CiA 301, 7.2.4.3.4: toggle, unused bytes, last
void SdoClient::put_download_segment() {
  const std::size_t size = std::min(kSegmentBytes, data_.size() - sent_);
  const bool last = sent_ + size == data_.size();
  std::array<std::uint8_t, 8> bytes{};
  bytes[0] =
      static_cast<std::uint8_t>((toggle_ ? 0x10u : 0u) | (kSegmentBytes - size) << 1 | (last ? 1u : 0u));
  std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(sent_), size, bytes.begin() + 1);
  sent_ += size;
  last_seen_ = last;
  put(bytes);
}

void SdoClient::on_download_segment(const CanFrame& frame) {
  if ((frame.data[0] & 0xE0) != 0x20) return fail(sdo_abort::kCommand);
  if (((frame.data[0] & 0x10) != 0) != toggle_) return fail(sdo_abort::kToggle);
  toggle_ = !toggle_;
  last_seen_ ? end(State::kDone) : put_download_segment();
}

void SdoClient::on_upload(const CanFrame& frame) {
  const std::uint8_t command = frame.data[0];
  if ((command & 0xE0) != 0x40 || !names_our_object(frame)) return fail(sdo_abort::kCommand);
  const bool expedited = command & 0x02, sized = command & 0x01;
  if (expedited) {
    const std::size_t size = sized ? 4u - (command >> 2 & 3u) : 4u;
    data_.assign(frame.data.begin() + 4, frame.data.begin() + 4 + static_cast<std::ptrdiff_t>(size));
    return end(State::kDone);
  }
  announced_ = sized ? word_at(frame, 4) : 0;
  // A node that announces a gigabyte must not make this process take the memory.
  if (announced_ > config_.size_max) return fail(sdo_abort::kMemory);
  phase_ = Phase::kUploadSegment;
  put({kUploadSegmentRequest});
}

void SdoClient::on_upload_segment(const CanFrame& frame) {
  const std::uint8_t command = frame.data[0];
  if ((command & 0xE0) != 0) return fail(sdo_abort::kCommand);
  if (((command & 0x10) != 0) != toggle_) return fail(sdo_abort::kToggle);
  const std::size_t size = kSegmentBytes - (command >> 1 & 7u);
  data_.insert(data_.end(), frame.data.begin() + 1,
               frame.data.begin() + 1 + static_cast<std::ptrdiff_t>(size));
  if (data_.size() > config_.size_max) return fail(sdo_abort::kMemory);
  toggle_ = !toggle_;
  if (!(command & 0x01))
    return put({static_cast<std::uint8_t>(kUploadSegmentRequest | (toggle_ ? 0x10 : 0))});
  if (announced_ != 0 && announced_ != data_.size()) return fail(sdo_abort::kLength);
  end(State::kDone);
}

void SdoClient::on_block_download(const CanFrame& frame) {
  if ((frame.data[0] & 0xE3) != 0xA0 || !names_our_object(frame)) return fail(sdo_abort::kCommand);
  block_size_ = frame.data[4];
  put_block();
}

// One sub-block of segments, CiA 301, 7.2.4.3.8: each carries its number and whether it is the last
void SdoClient::put_block() {
  if (block_size_ < 1 || block_size_ > kBlockSegments) return fail(sdo_abort::kBlockSize);
  block_start_ = sent_;
  phase_ = Phase::kBlockDownloadAck;
  // All segments of a sub-block without waiting for an answer: that is what makes a block transfer fast.
  for (sequence_ = 0; sequence_ < block_size_ && sent_ < data_.size();) {
    const std::size_t size = std::min(kSegmentBytes, data_.size() - sent_);
    std::array<std::uint8_t, 8> bytes{};
    std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(sent_), size, bytes.begin() + 1);
    sent_ += size;
    bytes[0] = static_cast<std::uint8_t>(++sequence_ | (sent_ == data_.size() ? 0x80 : 0));
    put(bytes);
  }
}

void SdoClient::on_block_ack(const CanFrame& frame) {
  if (frame.data[0] != 0xA2) return fail(sdo_abort::kCommand);
  const int acknowledged = frame.data[1];
  if (acknowledged > sequence_) return fail(sdo_abort::kSequence);
  // A node that takes nothing would keep the transfer alive for ever, for each of its answers renews the
  // time.
  idle_acks_ = acknowledged > 0 ? 0 : idle_acks_ + 1;
  if (idle_acks_ > kIdleAcks) return fail(sdo_abort::kSequence);
  // segments behind the last good one are sent again
  sent_ = std::min(block_start_ + kSegmentBytes * static_cast<std::size_t>(acknowledged), data_.size());
  block_size_ = frame.data[2];
  sent_ < data_.size() ? put_block() : put_block_end();
}

void SdoClient::put_block_end() {
  phase_ = Phase::kBlockDownloadEnd;
  // The last segment has always seven bytes on the wire. How many of them are no data is told only here.
  const std::size_t in_last = data_.size() % kSegmentBytes;
  const std::size_t unused = in_last == 0 ? 0 : kSegmentBytes - in_last;
  const std::uint16_t crc = sdo_crc(data_);
  put({static_cast<std::uint8_t>(0xC1 | unused << 2), static_cast<std::uint8_t>(crc),
       static_cast<std::uint8_t>(crc >> 8)});
}

void SdoClient::on_block_upload(const CanFrame& frame) {
  if ((frame.data[0] & 0xE1) != 0xC0 || !names_our_object(frame)) {  // a node without block transfer
    return fail(sdo_abort::kCommand);
  }
  announced_ = frame.data[0] & kSizeIndicated ? word_at(frame, 4) : 0;
  if (announced_ > config_.size_max) return fail(sdo_abort::kMemory);
  phase_ = Phase::kBlockUploadData;
  sequence_ = 0;
  put({0xA3});
}

void SdoClient::on_block_data(const CanFrame& frame) {
  const int number = frame.data[0] & 0x7F;
  // A segment that is missing breaks the sub-block: the rest of it is heard but not kept, and the
  // acknowledgement names the last good one, behind which the node begins again.
  const bool in_order = number == sequence_ + 1 && !sequence_broken_;
  sequence_broken_ |= !in_order;
  if (in_order) {
    sequence_ = number;
    last_seen_ = frame.data[0] & 0x80;
    data_.insert(data_.end(), frame.data.begin() + 1, frame.data.begin() + 8);
    // The last segment may have up to seven bytes that are no data, so the exact length is judged at the end.
    if (data_.size() > config_.size_max + kSegmentBytes) return fail(sdo_abort::kMemory);
  }
  if (number == kBlockSegments || (frame.data[0] & 0x80)) acknowledge_block();
}

void SdoClient::acknowledge_block() {
  put({0xA2, static_cast<std::uint8_t>(sequence_), kBlockSegments});
  sequence_broken_ = false;
  sequence_ = 0;
  if (last_seen_) phase_ = Phase::kBlockUploadEnd;
}

void SdoClient::on_block_end(const CanFrame& frame) {
  if ((frame.data[0] & 0xE3) != 0xC1) return fail(sdo_abort::kCommand);
  const std::size_t unused = frame.data[0] >> 2 & 7u;
  if (unused > data_.size()) return fail(sdo_abort::kLength);
  // Before length and checksum are judged: both are of the data alone.
  data_.resize(data_.size() - unused);
  if (announced_ != 0 && announced_ != data_.size()) return fail(sdo_abort::kLength);
  if (sdo_crc(data_) != get_le(frame.data.data() + 1, 2)) return fail(sdo_abort::kCrc);
  put({0xA1});
  end(State::kDone);
}

void SdoClient::poll(std::int64_t now_ns) {
  if (state_ == State::kBusy && now_ns >= deadline_ns_) fail(sdo_abort::kTimeout);
}

bool SdoClient::next_frame(CanFrame& frame) {
  if (out_.empty()) return false;
  frame = out_.front();
  out_.pop_front();
  return true;
}

}  // namespace trn
