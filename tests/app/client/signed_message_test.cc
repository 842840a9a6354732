#include "app/client/signed_message.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "app/client/signing_key.h"
#include "hal/message_codec.h"

namespace trn {
namespace {

using trunnion::command_t;
using trunnion::signed_command_t;

std::vector<std::uint8_t> bytes_of(const std::string& hex) {
  std::vector<std::uint8_t> out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    out.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return out;
}

// RFC 8032, 7.1, test 1.
SigningKey key() {
  const auto bytes = bytes_of("9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60");
  SigningKey::Seed seed{};
  std::copy(bytes.begin(), bytes.end(), seed.begin());
  return {"anna", seed};
}

command_t jog() {
  command_t out{};
  out.client = 77;
  out.sequence = 3;
  out.expires_us = 5'000'000;
  out.verb = command_t::JOG;
  out.value = -2.5;
  out.speed = 1.25;
  out.text = "Y";
  return out;
}

signed_command_t signed_jog() {
  return sign_message(key(), "mill", 1'700'000'000'000'000, signed_command_t::COMMAND, encode_inner(jog()));
}

// Bytes and signature as tests/support/ed25519.py and the encoder that lcm-gen writes for Python have them.
TEST(SignedMessage, HasTheBytesAndTheSignatureOfAnotherProgram) {
  const signed_command_t message = signed_jog();
  EXPECT_EQ(
      signed_bytes("mill", message),
      bytes_of("7472756e6e696f6e207369676e656420636f6d6d616e64203100000000046d696c6c00000004616e6e6100060a24"
               "181e4000010000003725d6e4ced9bdd9ff000000000000004d0000000300000000004c4b400700000000c00400"
               "00000000003ff4000000000000000000025900"));
  const auto signature = bytes_of(
      "2a69fd43be63be795b8fde69477ef1bf30cb064694bc3b8e7576ab5d1022ab43bc85dd78c2070ec870e6a38499f14ca698"
      "65e1c76c9d08da4ce9314f52c18002");
  EXPECT_TRUE(std::equal(signature.begin(), signature.end(), message.signature));
  EXPECT_TRUE(is_true(message, "mill", key().public_key()));
}

TEST(SignedMessage, IsForOneMachineAndOfOneKey) {
  const signed_command_t message = signed_jog();
  const PublicKey own = key().public_key();
  for (const char* machine : {"", "mil", "mill2", "Mill", "lathe"})
    EXPECT_FALSE(is_true(message, machine, own));
  PublicKey other = own;
  other[0] ^= 1;
  EXPECT_FALSE(is_true(message, "mill", other));
}

TEST(SignedMessage, IsFalseWhenAnyFieldDiffers) {
  const PublicKey own = key().public_key();
  const auto changed = [&](auto change) {
    signed_command_t message = signed_jog();
    change(message);
    return is_true(message, "mill", own);
  };
  EXPECT_TRUE(changed([](auto&) {}));
  EXPECT_FALSE(changed([](auto& m) { m.key = "ann"; }));
  EXPECT_FALSE(changed([](auto& m) { m.counter += 1; }));
  EXPECT_FALSE(changed([](auto& m) { m.kind = signed_command_t::SENSOR; }));
  EXPECT_FALSE(changed([](auto& m) { m.inner.push_back(0); }));
  EXPECT_FALSE(changed([](auto& m) { m.inner.pop_back(); }));
  EXPECT_FALSE(changed([](auto& m) { std::fill_n(m.signature, 64, std::uint8_t{0}); }));
}

// What stands at a border cannot be pushed from one field into the next.
TEST(SignedMessage, HasNoBytesOfAnother) {
  signed_command_t one{}, other{};
  one.key = std::string("ab");  // gcc 12 warns of an assignment of the characters alone
  other.key = std::string("b");
  EXPECT_NE(signed_bytes("mill", one), signed_bytes("milla", other));
  one = other = {};
  one.inner = {0, 0, 0, 1, 7};
  other.inner = {7};
  EXPECT_NE(signed_bytes("mill", one), signed_bytes("mill", other));
}

}  // namespace
}  // namespace trn
