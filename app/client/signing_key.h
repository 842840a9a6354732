#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "app/client/command_rights.h"
#include "app/client/private_file.h"

namespace trn {

using PublicKey = std::array<std::uint8_t, 32>;
using Signature = std::array<std::uint8_t, 64>;

/// "" if a key may be called so; otherwise what is legal.
std::string refuse_key_name(const std::string& name);

/// The public key in these 44 characters of base64 (RFC 4648); nothing if they are none.
std::optional<PublicKey> public_key_of(std::string_view base64);
/// As 44 characters of base64.
std::string text_of(const PublicKey& key);
/// The key in the first line of the file. KeyError.
PublicKey read_public_key(const std::string& path);

/// True if who has the private half of `key` signed these bytes (Ed25519, RFC 8032).
bool is_signed_by(const PublicKey& key, std::span<const std::uint8_t> bytes, const Signature& signature);

/// A number that follows from these two, and from which neither follows (BLAKE2b).
std::uint64_t mixed_number(const PublicKey& key, std::uint64_t number);

/// A private key for Ed25519 (RFC 8032) with the name under which the machine knows it. The secret half
/// leaves the memory with the object.
class SigningKey {
 public:
  using Seed = std::array<std::uint8_t, 32>;  ///< the private key of RFC 8032

  SigningKey(std::string name, const Seed& seed);
  ~SigningKey();
  SigningKey(const SigningKey&) = delete;
  SigningKey& operator=(const SigningKey&) = delete;

  /// Of a file that `make_key_file` wrote. KeyError, also if others than this user can read it.
  static SigningKey read(const std::string& path);

  const std::string& name() const { return name_; }
  const PublicKey& public_key() const { return public_; }
  Signature sign(std::span<const std::uint8_t> bytes) const;

 private:
  std::string name_;
  PublicKey public_;
  std::array<std::uint8_t, 64> secret_;  // seed and public key, as libsodium has them
};

/// Makes a pair and writes the private key's file, which nobody but this user can read (mode 0600). KeyError
/// if something is there already, or it cannot be written.
void make_key_file(const std::string& path, const std::string& name);

/// The section of the machine's config that lets this key in.
std::string config_section(const std::string& name, const PublicKey& key, Role role);

}  // namespace trn
