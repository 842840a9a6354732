#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/client/signing_key.h"
#include "hal/lcm_messages.h"

namespace trn {

/// The bytes that the signature of `message` is for, on the machine of this name. As the fields have lengths,
/// no two messages have the same.
std::vector<std::uint8_t> signed_bytes(const std::string& machine, const trunnion::signed_command_t& message);

/// A command_t or sensor_t (its payload `inner`, of this `kind`) with the signature of `key`.
trunnion::signed_command_t sign_message(const SigningKey& key, const std::string& machine,
                                        std::int64_t counter, std::int8_t kind,
                                        std::vector<std::uint8_t> inner);

/// True if the holder of `key` signed this message for this machine.
bool is_true(const trunnion::signed_command_t& message, const std::string& machine, const PublicKey& key);

}  // namespace trn
