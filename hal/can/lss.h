#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "hal/can/bus.h"
#include "hal/can/frame.h"

// Layer setting services, CiA 305: node ids and bit rates of nodes that have none, or another one.
namespace trn {

namespace lss {
inline constexpr std::uint32_t kToNode = 0x7E5, kToMaster = 0x7E4;
/// Command specifiers, CiA 305, 6.
inline constexpr std::uint8_t kSwitchAll = 0x04, kSelectVendor = 0x40, kSelectProduct = 0x41,
                              kSelectRevision = 0x42, kSelectSerial = 0x43, kSelected = 0x44,
                              kSetNodeId = 0x11, kSetBitTiming = 0x13, kActivateBitTiming = 0x15,
                              kStore = 0x17, kFound = 0x4F, kFastScan = 0x51, kAskVendor = 0x5A,
                              kAskNodeId = 0x5E;
inline constexpr std::uint8_t kWaiting = 0, kConfiguration = 1;  ///< of kSwitchAll
inline constexpr std::uint8_t kScanAll = 0x80;                   ///< bits checked: is anybody there at all?
inline constexpr int kNoNodeId = 255;
}  // namespace lss

/// Vendor, product, revision and serial number, as in 0x1018: no two nodes have the same.
using LssIdentity = std::array<std::uint32_t, 4>;
std::string to_string(const LssIdentity& identity);

/// Number of a bit rate in the standard's table (CiA 305, table 1); nothing: it has none.
std::optional<int> lss_bit_rate_index(int bitrate);
/// The rates of that table.
std::string lss_bit_rates();

/// The master's side, one service at a time. Pure: frames and time in, frames out. Not for the tick.
class LssMaster {
 public:
  enum class State : std::uint8_t { kIdle, kBusy, kDone, kFailed };

  /// `timeout_ns`: how long an answer may take; silence is an answer as well, so that a search needs it
  /// often.
  explicit LssMaster(std::int64_t timeout_ns) : timeout_ns_(timeout_ns) {}

  /// All nodes back to the waiting state; nobody answers.
  void leave(std::int64_t now_ns);
  /// The one node of this identity goes to the configuration state.
  void select(const LssIdentity& identity, std::int64_t now_ns);
  /// Finds one node without a node id, by its bits (fastscan), and selects it. Several: the lowest identity.
  void find(std::int64_t now_ns);
  /// The rest is for the node that is selected.
  /// Waits for the whole time-out: two answers are two nodes with the same identity.
  void ask_node_id(std::int64_t now_ns);
  void set_node_id(int id, std::int64_t now_ns);
  void set_bit_rate(int index, std::int64_t now_ns);
  void store(std::int64_t now_ns);

  void receive(const CanFrame& frame, std::int64_t now_ns);
  void poll(std::int64_t now_ns);
  bool next_frame(CanFrame& frame);

  State state() const { return state_; }
  /// Why it failed: what, and what would be right.
  const std::string& error() const { return error_; }
  const LssIdentity& identity() const { return identity_; }  ///< of a search
  int node_id() const { return node_id_; }                   ///< that was asked for

 private:
  enum class Service : std::uint8_t { kLeave, kSelect, kFind, kAsk, kSetId, kSetRate, kStore };
  void begin(Service service);
  void put(std::uint8_t command, std::uint64_t value, std::int64_t now_ns);
  void scan(std::int64_t now_ns);
  void scanned(bool answered, std::int64_t now_ns);
  void judge(const CanFrame& frame);
  void judge_node_id();
  void fail_silent();
  void fail(const std::string& what);

  std::int64_t timeout_ns_, deadline_ns_ = 0;
  State state_ = State::kIdle;
  Service service_ = Service::kLeave;
  std::deque<CanFrame> out_;
  std::string error_;
  LssIdentity identity_{};
  std::uint8_t expected_ = 0;
  int node_id_ = lss::kNoNodeId, asked_ = 0;
  int part_ = -1, bit_ = 0;  ///< of a search: part of the identity, bit of it; -1: is anybody there?
  bool answered_ = false;
  int answers_ = 0;     ///< to kAsk
  int wrong_size_ = 0;  ///< bytes of an answer that is no answer; 0: there was none
};

/// Lets the service go over the bus to its end; its error, "" when it is done.
std::string run_lss(CanEndpoint& bus, LssMaster& master);

}  // namespace trn
