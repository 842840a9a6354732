#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trn {

/// One field of a message as LCM writes it: big-endian, without gaps, in the order of its .lcm file.
struct WireField {
  enum class Kind : std::uint8_t {
    kNumber,  ///< `size_bytes` bytes, any value
    kCount,   ///< an int32_t >= 0, the number of elements of fields that follow
    kString   ///< an int32_t length >= 1, then so many bytes, the last of them and no other zero
  };
  Kind kind;
  std::uint8_t size_bytes;
  std::uint16_t times;      ///< elements, where `count_field` is -1
  std::int8_t count_field;  ///< which of the type's kCount fields says how many elements there are
};

/// The fields of a generated message type: `kFields`, made from its .lcm file at build time.
template <typename Message>
struct WireLayout;

inline constexpr int kWireCountsMax = 16;  ///< kCount fields of one type

/// True if `payload` is `hash` and then exactly the fields: every count and length fits into the bytes that
/// are there. What passes can be decoded without a check of its own. Never allocates or throws.
bool well_formed(std::span<const std::uint8_t> payload, std::int64_t hash, std::span<const WireField> fields);

/// A datagram of LCM's small-message form: "LC02", sequence number, channel, 0, payload.
struct WireMessage {
  std::string_view channel;
  std::span<const std::uint8_t> payload;
};
inline constexpr std::size_t kDatagramBytesMax = 65507;  ///< what UDP carries
inline constexpr std::size_t kChannelBytesMax = 63;

/// Nothing if `datagram` is not of that form. Fragments (LC03) are none: no message of ours needs them.
std::optional<WireMessage> read_datagram(std::span<const std::uint8_t> datagram);

/// The head of a datagram; the payload follows. The channel has at most kChannelBytesMax bytes.
std::vector<std::uint8_t> datagram_head(std::uint32_t sequence, const std::string& channel);

}  // namespace trn
