#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/can/bus.h"
#include "hal/can/sdo.h"

namespace trn {

/// The node does not answer, or not what was asked.
struct SdoSilence : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads and writes objects of one node over an endpoint of one's own, and waits for each. Not for the tick.
class SdoTalk {
 public:
  SdoTalk(CanEndpoint& bus, int node, std::int64_t timeout_ns)
      : bus_(bus), node_(node), timeout_ns_(timeout_ns) {}

  /// Nothing: the node refuses, and `code` says why. SdoSilence where it does not answer.
  std::optional<std::vector<std::uint8_t>> read(ObjectKey key);
  bool write(ObjectKey key, std::uint64_t value, std::size_t bytes, std::int64_t timeout_ns);
  std::uint32_t code() const { return code_; }
  bool absent() const { return code_ == sdo_abort::kNoObject || code_ == sdo_abort::kNoSub; }

 private:
  bool transfer(SdoClient& client, ObjectKey key);

  CanEndpoint& bus_;
  int node_;
  std::int64_t timeout_ns_;
  std::uint32_t code_ = 0;
};

/// A node that answers, as it tells of itself.
struct FoundNode {
  int id = 0;
  std::uint32_t type = 0, vendor = 0, product = 0, revision = 0, serial = 0;
};

/// Everybody from 1 to `last` who answers for its device type (0x1000) in time.
std::vector<FoundNode> scan_nodes(CanEndpoint& bus, int last, std::int64_t timeout_ns);

}  // namespace trn
