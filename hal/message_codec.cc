#include "hal/message_codec.h"

#include <fmt/format.h>

#include <exception>
#include <optional>

namespace trn {

EncodedMessage encode_payload(std::uint32_t sequence, const std::string& channel, int payload_bytes,
                              const std::function<int(std::uint8_t*, int)>& encode) {
  EncodedMessage out{datagram_head(sequence, channel), ""};
  const std::size_t head = out.datagram.size();
  const std::size_t bytes = head + static_cast<std::size_t>(payload_bytes);
  if (channel.size() > kChannelBytesMax || bytes > kDatagramBytesMax) {
    out.error = fmt::format("a message of {} bytes is too long for '{}': {} are possible", payload_bytes,
                            channel, kDatagramBytesMax - head);
    return out;
  }
  out.datagram.resize(bytes);
  if (encode(out.datagram.data() + head, payload_bytes) != payload_bytes)
    out.error =
        fmt::format("a message for '{}' cannot be encoded: a list of it is shorter than its count", channel);
  return out;
}

bool MessageDispatcher::accept(std::span<const std::uint8_t> datagram) {
  const std::optional<WireMessage> message = read_datagram(datagram);
  if (!message) return false;
  const auto found = handlers_.find(message->channel);
  if (found == handlers_.end()) return false;
  bool sound = false;
  for (const Handler& handler : found->second) {
    try {
      sound = handler(message->payload) || sound;
    } catch (const std::exception&) {  // one message must not end whoever listens
    }
  }
  if (!sound) ++dropped_;
  return sound;
}

}  // namespace trn
