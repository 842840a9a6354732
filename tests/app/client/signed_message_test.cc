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
      bytes_of("7472756e6e696f6e207369676e656420636f6d6d616e64203100000000046d696c6c00000004616e6e6100060a"
               "24181e40000100000044e2d1c98dd40ff8ee000000000000004d0000000300000000004c4b400700000000c004"
               "0000000000003ff400000000000000000000000000000000000000000000025900"));
  const auto signature = bytes_of(
      "907ecb8fc0295287ba7d03e8d616a887e7e7a5eb7450df01e464dcd1e37473ec6b60bc6d1389adecfa6c24bc403c1f2dbd"
      "d6a42fb560eec5f873da425bc6550d");
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
