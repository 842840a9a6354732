#include "app/client/signing_key.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "app/client/private_file.h"
#include "core/config.h"

namespace trn {

namespace {

static_assert(crypto_sign_PUBLICKEYBYTES == sizeof(PublicKey) && crypto_sign_BYTES == sizeof(Signature) &&
              crypto_sign_SEEDBYTES == sizeof(SigningKey::Seed) && crypto_sign_SECRETKEYBYTES == 64);

// A name stands in files and logs beside other words.
constexpr std::string_view kNameLetters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._@-";
constexpr std::size_t kNameMax = 40;

constexpr std::size_t kTextBytes = 44;  // 32 bytes in base64
constexpr int kBase64 = sodium_base64_VARIANT_ORIGINAL;
constexpr const char* kHead =
    "# A private key of Trunnion: who has this file may command the machines that know its public half.\n";

void begin_sodium() {
  static const bool ready = sodium_init() >= 0;
  if (!ready) throw KeyError("libsodium does not work on this host");
}

using Key32 = std::array<std::uint8_t, 32>;

std::optional<Key32> decode(std::string_view text) {
  Key32 out{};
  std::size_t size = 0;
  const char* end = nullptr;
  const bool whole = text.size() == kTextBytes &&
                     sodium_base642bin(out.data(), out.size(), text.data(), text.size(), nullptr, &size, &end,
                                       kBase64) == 0 &&
                     size == out.size() && end == text.data() + text.size();
  return whole ? std::optional(out) : std::nullopt;
}

std::string encode(const Key32& bytes) {
  char text[kTextBytes + 1];
  sodium_bin2base64(text, sizeof text, bytes.data(), bytes.size(), kBase64);
  return text;
}

[[noreturn]] void refuse(const std::string& path, std::string_view why) {
  throw KeyError(fmt::format("{}: {}", path, why));
}

/// Closes at the end of its scope.
struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

void write_all(int fd, std::string_view text, const std::string& path) {
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (written && fsync(fd) == 0) return;
  const int error = errno;
  unlink(path.c_str());
  refuse(path, fmt::format("cannot be written: {}", std::strerror(error)));
}

}  // namespace

std::string refuse_key_name(const std::string& name) {
  const bool legal =
      !name.empty() && name.size() <= kNameMax && name.find_first_not_of(kNameLetters) == std::string::npos;
  return legal ? "" : "the name of a key has 1 to 40 letters, digits and . _ @ -";
}

std::optional<PublicKey> public_key_of(std::string_view base64) { return decode(base64); }

std::string text_of(const PublicKey& key) { return encode(key); }

PublicKey read_public_key(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) refuse(path, "the file of a public key cannot be read");
  if (line.starts_with("# A private key"))
    refuse(path, "is a private key; the machine needs the public one alone ('trunnion key show' prints it)");
  const std::optional<PublicKey> key = public_key_of(line);
  if (!key)
    refuse(path, "the first line is no public key: 44 characters, as 'trunnion key show' prints them");
  return *key;
}

bool is_signed_by(const PublicKey& key, std::span<const std::uint8_t> bytes, const Signature& signature) {
  begin_sodium();
  return crypto_sign_verify_detached(signature.data(), bytes.data(), bytes.size(), key.data()) == 0;
}

std::uint64_t mixed_number(const PublicKey& key, std::uint64_t number) {
  begin_sodium();
  std::array<std::uint8_t, sizeof number> bytes;
  std::memcpy(bytes.data(), &number, sizeof number);
  std::array<std::uint8_t, crypto_generichash_BYTES> hash;
  crypto_generichash(hash.data(), hash.size(), bytes.data(), bytes.size(), key.data(), key.size());
  std::uint64_t out = 0;
  std::memcpy(&out, hash.data(), sizeof out);
  return out;
}

SigningKey::SigningKey(std::string name, const Seed& seed) : name_(std::move(name)) {
  begin_sodium();
  crypto_sign_seed_keypair(public_.data(), secret_.data(), seed.data());
}

SigningKey::~SigningKey() { sodium_memzero(secret_.data(), secret_.size()); }

SigningKey SigningKey::read(const std::string& path) {
  begin_sodium();
  std::string text = read_private_file(path);
  std::string name, secret;
  try {
    const ConfigTable root = parse_config(text, path);
    name = root.text("name");
    secret = root.text("private");
    root.finish();
  } catch (const ConfigError& error) {
    throw KeyError(fmt::format("{}; a key file is made with 'trunnion key make FILE NAME'", error.what()));
  }
  sodium_memzero(text.data(), text.size());
  std::optional<Seed> seed = decode(secret);
  sodium_memzero(secret.data(), secret.size());
  if (const std::string bad = refuse_key_name(name); !bad.empty()) refuse(path, bad);
  if (!seed) refuse(path, "'private' is no key: 44 characters of base64 belong there");
  const Seed copy = *seed;
  sodium_memzero(seed->data(), seed->size());
  return {name, copy};
}

Signature SigningKey::sign(std::span<const std::uint8_t> bytes) const {
  Signature signature;
  crypto_sign_detached(signature.data(), nullptr, bytes.data(), bytes.size(), secret_.data());
  return signature;
}

void make_key_file(const std::string& path, const std::string& name) {
  begin_sodium();
  if (const std::string bad = refuse_key_name(name); !bad.empty()) throw KeyError(bad);
  SigningKey::Seed seed;
  randombytes_buf(seed.data(), seed.size());
  std::string text = fmt::format("{}name = \"{}\"\nprivate = \"{}\"\n", kHead, name, encode(seed));
  sodium_memzero(seed.data(), seed.size());
  const Descriptor file{open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600)};
  if (file.fd < 0)
    refuse(path, errno == EEXIST ? "is there already and is not written over; name another file"
                                 : std::strerror(errno));
  write_all(file.fd, text, path);
  sodium_memzero(text.data(), text.size());
}

std::string config_section(const std::string& name, const PublicKey& key, Role role) {
  return fmt::format("[[gateway.key]]\nname = \"{}\"\npublic = \"{}\"\nrole = \"{}\"\n", name, text_of(key),
                     to_string(role));
}

}  // namespace trn
