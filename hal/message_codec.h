#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/lcm_messages.h"
#include "hal/wire_layout.h"
#include "lcm_types/layouts.h"

namespace trn {

/// A message in LCM's wire form ("LC02", sequence number, channel, 0, payload): what goes over UDP, and over
/// the daemon's local socket as one packet.
struct EncodedMessage {
  std::vector<std::uint8_t> datagram;
  std::string error;  ///< why the message has no such form; "" if it has
};

/// `encode` writes the payload's bytes and returns how many it wrote.
EncodedMessage encode_payload(std::uint32_t sequence, const std::string& channel, int payload_bytes,
                              const std::function<int(std::uint8_t*, int)>& encode);

template <typename Message>
EncodedMessage encode_message(std::uint32_t sequence, const std::string& channel, const Message& message) {
  return encode_payload(sequence, channel, message.getEncodedSize(),
                        [&](std::uint8_t* to, int size) { return message.encode(to, 0, size); });
}

/// The payload of a message alone, as it lies in another message; empty if it cannot be encoded.
template <typename Message>
std::vector<std::uint8_t> encode_inner(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  const int size = static_cast<int>(bytes.size());
  if (message.encode(bytes.data(), 0, size) != size) bytes.clear();
  return bytes;
}

/// The message of a payload; nothing if it is not well formed.
template <typename Message>
std::optional<Message> decode_inner(std::span<const std::uint8_t> payload) {
  if (!well_formed(payload, Message::getHash(), WireLayout<Message>::kFields)) return std::nullopt;
  Message message{};
  if (message.decode(payload.data(), 0, static_cast<int>(payload.size())) < 0) return std::nullopt;
  return message;
}

/// Hands the messages in datagrams to whom they are for. Whatever arrives is checked whole against the layout
/// of its type before a decoder sees it; what is not well formed, fragments among it, is dropped and counted.
class MessageDispatcher {
 public:
  template <typename Message>
  void subscribe(const std::string& channel, std::function<void(const Message&)> receive) {
    handlers_[channel].push_back([receive = std::move(receive)](std::span<const std::uint8_t> payload) {
      const std::optional<Message> message = decode_inner<Message>(payload);
      if (message) receive(*message);
      return message.has_value();
    });
  }

  /// Hands on what is in one datagram; false if nothing is. No exception of a handler leaves it.
  bool accept(std::span<const std::uint8_t> datagram);
  /// How many datagrams came on a channel that is listened to but were no sound message of its type.
  std::uint64_t dropped() const { return dropped_; }

 private:
  using Handler = std::function<bool(std::span<const std::uint8_t>)>;

  std::map<std::string, std::vector<Handler>, std::less<>> handlers_;
  std::uint64_t dropped_ = 0;
};

}  // namespace trn
