#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

// What the fuzz targets share: what must hold of every input, and bytes taken from the front of one.
namespace trn::fuzz {

/// The fuzzer keeps an input that ends the process.
inline void require(bool holds, std::string_view what) {
  if (holds) return;
  std::fprintf(stderr, "not so: %.*s\n", static_cast<int>(what.size()), what.data());
  std::abort();
}

/// `message` begins with "file:line: " or "file:line:column: ".
inline void require_place(std::string_view message, std::string_view file) {
  constexpr std::string_view kDigits = "0123456789";
  const std::size_t from = file.size() + 1;
  const bool named =
      message.size() > from && message.substr(0, file.size()) == file && message[file.size()] == ':';
  const std::size_t end = named ? message.find_first_not_of(kDigits, from) : from;
  const bool numbered = end != std::string_view::npos && end > from && message[end] == ':';
  require(numbered, std::string("a place in front of: ").append(message));
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Numbers and bytes from the front of an input; 0 where it is at its end.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : left_(data, size) {}

  bool empty() const { return left_.empty(); }
  std::uint8_t byte() {
    if (left_.empty()) return 0;
    const std::uint8_t value = left_.front();
    left_ = left_.subspan(1);
    return value;
  }
  /// Fewer where there are no more.
  std::span<const std::uint8_t> some(std::size_t count) {
    const std::span<const std::uint8_t> taken = left_.first(count < left_.size() ? count : left_.size());
    left_ = left_.subspan(taken.size());
    return taken;
  }

 private:
  std::span<const std::uint8_t> left_;
};

}  // namespace trn::fuzz
