#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/can/frame.h"

// Service data objects, CiA 301, 7.2.4: the way into a node's object dictionary. Not for the tick.
namespace trn {

/// Index and sub-index of an object.
struct ObjectKey {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  auto operator<=>(const ObjectKey&) const = default;
};
/// "0x6041" or "0x1018:2" (sub-index 0 is left out when `always_sub` is false).
std::string to_string(ObjectKey key, bool always_sub = true);

/// Abort codes, CiA 301, table 22.
namespace sdo_abort {
inline constexpr std::uint32_t kToggle = 0x05030000, kTimeout = 0x05040000, kCommand = 0x05040001,
                               kBlockSize = 0x05040002, kSequence = 0x05040003, kCrc = 0x05040004,
                               kMemory = 0x05040005, kAccess = 0x06010000, kWriteOnly = 0x06010001,
                               kReadOnly = 0x06010002, kNoObject = 0x06020000, kNotMappable = 0x06040041,
                               kPdoLength = 0x06040042, kHardware = 0x06060000, kLength = 0x06070010,
                               kTooLong = 0x06070012, kTooShort = 0x06070013, kNoSub = 0x06090011,
                               kValueRange = 0x06090030, kValueHigh = 0x06090031, kValueLow = 0x06090032,
                               kGeneral = 0x08000000, kStore = 0x08000020, kState = 0x08000022;
}
/// What the code means, in words.
std::string_view sdo_abort_text(std::uint32_t code);

/// CRC of a block transfer: x^16 + x^12 + x^5 + 1, start 0 (CiA 301, 7.2.4.3.16).
std::uint16_t sdo_crc(std::span<const std::uint8_t> bytes);

/// The client's side of one transfer at a time with one node: expedited, segmented or block.
class SdoClient {
 public:
  enum class State : std::uint8_t { kIdle, kBusy, kDone, kAborted };
  struct Config {
    int node = 1;  ///< 1 to 127; default SDO channel 0x600 / 0x580 + node
    std::int64_t timeout_ns = 500'000'000;
    std::size_t size_max = 1 << 20;  ///< of an upload
    std::size_t block_from = 64;     ///< downloads of at least this many bytes go by block; 0: never
    bool block_upload = false;
  };

  explicit SdoClient(const Config& config) : config_(config) {}

  /// Begin a transfer; whatever was under way is forgotten.
  void read(ObjectKey key, std::int64_t now_ns);
  void write(ObjectKey key, std::span<const std::uint8_t> bytes, std::int64_t now_ns);

  /// A frame from the bus; others than the node's SDO answers are left alone.
  void receive(const CanFrame& frame, std::int64_t now_ns);
  /// Ends the transfer when the node has been silent for too long.
  void poll(std::int64_t now_ns);
  /// What has to be sent next.
  bool next_frame(CanFrame& frame);

  State state() const { return state_; }
  const std::vector<std::uint8_t>& data() const { return data_; }  ///< of a finished read
  std::uint32_t abort_code() const { return abort_code_; }
  bool aborted_by_node() const { return aborted_by_node_; }

 private:
  enum class Phase : std::uint8_t {
    kDownload,
    kDownloadSegment,
    kUpload,
    kUploadSegment,
    kBlockDownload,
    kBlockDownloadAck,
    kBlockDownloadEnd,
    kBlockUpload,
    kBlockUploadData,
    kBlockUploadEnd
  };

  void begin(ObjectKey key, Phase phase, std::int64_t now_ns);
  void put(std::span<const std::uint8_t> bytes);
  void put(std::initializer_list<std::uint8_t> bytes) {
    put(std::span<const std::uint8_t>(bytes.begin(), bytes.size()));
  }
  void put_initiate(std::uint8_t command, std::uint32_t value);
  void end(State state) { state_ = state; }
  void fail(std::uint32_t code);
  bool names_our_object(const CanFrame& frame) const;

  void answer(const CanFrame& frame);
  void on_download(const CanFrame& frame);
  void on_download_segment(const CanFrame& frame);
  void put_download_segment();
  void on_upload(const CanFrame& frame);
  void on_upload_segment(const CanFrame& frame);
  void on_block_download(const CanFrame& frame);
  void put_block();
  void on_block_ack(const CanFrame& frame);
  void put_block_end();
  void on_block_upload(const CanFrame& frame);
  void on_block_data(const CanFrame& frame);
  void acknowledge_block();
  void on_block_end(const CanFrame& frame);

  Config config_;
  State state_ = State::kIdle;
  Phase phase_ = Phase::kUpload;
  ObjectKey key_;
  std::vector<std::uint8_t> data_;
  std::deque<CanFrame> out_;
  std::int64_t deadline_ns_ = 0;
  std::uint32_t abort_code_ = 0, announced_ = 0;
  std::size_t sent_ = 0, block_start_ = 0;
  int block_size_ = 0, sequence_ = 0, idle_acks_ = 0;
  bool toggle_ = false, aborted_by_node_ = false, sequence_broken_ = false, last_seen_ = false;
};

}  // namespace trn
