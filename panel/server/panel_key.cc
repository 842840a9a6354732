#include "panel/server/panel_key.h"

#include <fmt/format.h>
#include <sodium.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "app/client/private_file.h"
#include "app/client/signing_key.h"

namespace trn {

namespace {

constexpr std::size_t kKeyBytes = 16, kDigitsMin = 2 * kKeyBytes, kDigitsMax = 128;

}  // namespace

PanelKey PanelKey::make() {
  if (sodium_init() < 0) throw KeyError("libsodium does not work on this host");
  std::array<std::uint8_t, kKeyBytes> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  std::array<char, 2 * kKeyBytes + 1> text{};
  sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  return PanelKey(text.data());
}

PanelKey PanelKey::read(const std::string& path) {
  std::string text = read_private_file(path);
  const std::string_view line = std::string_view(text).substr(0, text.find('\n'));
  const bool digits = line.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  if (!digits || line.size() < kDigitsMin || line.size() > kDigitsMax)
    throw KeyError(
        fmt::format("{}: the first line is no key of {} to {} hexadecimal digits; make one with "
                    "'(umask 077; openssl rand -hex 16 >{})'",
                    path, kDigitsMin, kDigitsMax, path));
  const PanelKey key(line);
  sodium_memzero(text.data(), text.size());
  return key;
}

PanelKey::~PanelKey() { sodium_memzero(text_.data(), text_.size()); }

bool PanelKey::is(std::string_view text) const {
  return text.size() == text_.size() && sodium_memcmp(text.data(), text_.data(), text_.size()) == 0;
}

}  // namespace trn
