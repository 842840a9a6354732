#include "hal/wire_layout.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace trn {

namespace {

constexpr std::uint32_t kSmallMessage = 0x4c433032;  // "LC02"
constexpr std::size_t kHeadBytes = 8;

/// Walks over big-endian fields; a step that does not fit fails, and leaves the place where it is.
class WireWalk {
 public:
  explicit WireWalk(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  bool skip(std::uint64_t bytes) {
    if (bytes > left_.size()) return false;
    left_ = left_.subspan(static_cast<std::size_t>(bytes));
    return true;
  }
  bool number(int size_bytes, std::int64_t& value) {
    const std::span<const std::uint8_t> here = left_;
    if (!skip(static_cast<std::uint64_t>(size_bytes))) return false;
    std::uint64_t out = 0;
    for (int i = 0; i < size_bytes; ++i) out = out << 8 | here[static_cast<std::size_t>(i)];
    value = size_bytes == 4 ? static_cast<std::int32_t>(out) : static_cast<std::int64_t>(out);
    return true;
  }
  // LCM's strings have their length in front, the closing zero included. There must be just one zero, at the
  // end: a decoder that looks for it would else stop too early or read off the datagram.
  bool text() {
    std::int64_t length = 0;
    if (!number(4, length) || length < 1 || static_cast<std::uint64_t>(length) > left_.size()) return false;
    const auto* zero =
        static_cast<const std::uint8_t*>(std::memchr(left_.data(), 0, static_cast<std::size_t>(length)));
    return zero == left_.data() + length - 1 && skip(static_cast<std::uint64_t>(length));
  }
  std::size_t left() const { return left_.size(); }

 private:
  std::span<const std::uint8_t> left_;
};

// `times` strings need four bytes each at least, so the loop ends with the datagram.
bool walk_field(WireWalk& walk, const WireField& field, std::uint64_t times) {
  if (field.kind == WireField::Kind::kNumber) return walk.skip(times * field.size_bytes);
  for (std::uint64_t i = 0; i < times; ++i)
    if (!walk.text()) return false;
  return true;
}

}  // namespace

bool well_formed(std::span<const std::uint8_t> payload, std::int64_t hash,
                 std::span<const WireField> fields) {
  WireWalk walk(payload);
  std::array<std::int64_t, kWireCountsMax> counts{};
  std::size_t counted = 0;
  std::int64_t value = 0;
  // The hash is made of the type's names and layout: another version of the same message has another one.
  if (!walk.number(8, value) || value != hash) return false;
  for (const WireField& field : fields) {
    if (field.kind == WireField::Kind::kCount) {
      // A negative count would become a huge one as unsigned.
      if (counted == counts.size() || !walk.number(4, value) || value < 0) return false;
      counts[counted++] = value;
      continue;
    }
    const bool counted_field = field.count_field >= 0;
    const std::int64_t times =
        counted_field ? counts[static_cast<std::size_t>(field.count_field)] : field.times;
    if (!walk_field(walk, field, static_cast<std::uint64_t>(times))) return false;
  }
  // Bytes behind the end mean that sender and receiver do not mean the same message.
  return walk.left() == 0;
}

std::optional<WireMessage> read_datagram(std::span<const std::uint8_t> datagram) {
  WireWalk walk(datagram);
  std::int64_t magic = 0, sequence = 0;
  if (!walk.number(4, magic) || magic != kSmallMessage || !walk.number(4, sequence)) return std::nullopt;
  const std::span<const std::uint8_t> rest = datagram.subspan(kHeadBytes);
  if (rest.empty()) return std::nullopt;
  // The zero is looked for only as far as a channel's name may go.
  const auto* zero = static_cast<const std::uint8_t*>(
      std::memchr(rest.data(), 0, std::min(rest.size(), kChannelBytesMax + 1)));
  if (!zero || zero == rest.data()) return std::nullopt;
  const auto length = static_cast<std::size_t>(zero - rest.data());
  return WireMessage{std::string_view(reinterpret_cast<const char*>(rest.data()), length),
                     rest.subspan(length + 1)};
}

std::vector<std::uint8_t> datagram_head(std::uint32_t sequence, const std::string& channel) {
  std::vector<std::uint8_t> out;
  for (const std::uint32_t word : {kSmallMessage, sequence})
    for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(word >> shift));
  out.insert(out.end(), channel.begin(), channel.end());
  out.push_back(0);
  return out;
}

}  // namespace trn
