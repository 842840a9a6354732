#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/can/bus.h"

namespace trn {

/// What a node keeps over a loss of power (CiA 301, 7.5.2.13); the value is the sub-index of 0x1010.
enum class StoredPart : std::uint8_t { kAll = 1, kCommunication = 2, kApplication = 3 };

/// A node that cannot or must not store now; what() has node, object and remedy.
struct StoreError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Has the node store its parameters (0x1010), which takes some seconds, and returns what was done. It must
/// not be in Operation Enabled. What tells a drive that was set up from one that was restarted since (0x1016,
/// 0x100C, 0x1006) is taken back before: stored, a lost position would pass for a good one.
std::vector<std::string> store_parameters(CanEndpoint& bus, int node, StoredPart part,
                                          std::int64_t timeout_ns);

}  // namespace trn
