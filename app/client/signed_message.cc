#include "app/client/signed_message.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace trn {

namespace {

using Bytes = std::vector<std::uint8_t>;

// With its closing zero: no other purpose of the key begins with the same bytes.
constexpr std::string_view kContext = {"trunnion signed command 1\0", 26};

void add_number(Bytes& out, std::uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
    out.push_back(static_cast<std::uint8_t>(value >> shift));
}

template <typename Text>
void add_text(Bytes& out, const Text& text) {
  add_number(out, text.size(), 4);
  out.insert(out.end(), text.begin(), text.end());
}

}  // namespace

Bytes signed_bytes(const std::string& machine, const trunnion::signed_command_t& message) {
  Bytes out(kContext.begin(), kContext.end());
  add_text(out, machine);
  add_text(out, message.key);
  add_number(out, static_cast<std::uint64_t>(message.counter), 8);
  add_number(out, static_cast<std::uint8_t>(message.kind), 1);
  add_text(out, message.inner);
  return out;
}

trunnion::signed_command_t sign_message(const SigningKey& key, const std::string& machine,
                                        std::int64_t counter, std::int8_t kind, Bytes inner) {
  trunnion::signed_command_t message{};
  message.key = key.name();
  message.counter = counter;
  message.kind = kind;
  message.inner = std::move(inner);
  message.size = static_cast<std::int32_t>(message.inner.size());
  const Signature signature = key.sign(signed_bytes(machine, message));
  std::copy(signature.begin(), signature.end(), message.signature);
  return message;
}

bool is_true(const trunnion::signed_command_t& message, const std::string& machine, const PublicKey& key) {
  Signature signature;
  std::copy_n(message.signature, signature.size(), signature.begin());
  return is_signed_by(key, signed_bytes(machine, message), signature);
}

}  // namespace trn
