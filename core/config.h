#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.h"

namespace trn {

/// A config that cannot be used; what() is "file:line:column: message".
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};
inline constexpr Range kAnyNumber{};
inline constexpr Range kPositive{std::numeric_limits<double>::min()};
inline constexpr Range kNotNegative{0.0};

/// One table of a strict TOML config. Reading a key marks it as known; `finish` refuses every key that nobody
/// read and names the nearest legal one. Every reader throws ConfigError with file, line and column for a
/// missing key, a wrong type or a value out of range; with a fallback the key may be missing. Copies share
/// their record of known keys.
class ConfigTable {
 public:
  double number(std::string_view key, Range range = kAnyNumber) const;
  double number(std::string_view key, double fallback, Range range) const;
  long integer(std::string_view key, Range range = kAnyNumber) const;
  long integer(std::string_view key, long fallback, Range range) const;
  bool boolean(std::string_view key) const;
  bool boolean(std::string_view key, bool fallback) const;
  std::string text(std::string_view key) const;
  std::string text(std::string_view key, std::string_view fallback) const;
  /// One of `choices`; the error lists them.
  std::string choice(std::string_view key, const std::vector<std::string>& choices) const;
  std::string choice(std::string_view key, const std::vector<std::string>& choices,
                     std::string_view fallback) const;
  Vec3 vec3(std::string_view key) const;
  Vec3 vec3(std::string_view key, const Vec3& fallback) const;
  std::vector<double> numbers(std::string_view key) const;
  std::vector<std::string> texts(std::string_view key) const;
  std::vector<std::string> texts(std::string_view key, const std::vector<std::string>& fallback) const;

  ConfigTable table(std::string_view key) const;
  std::optional<ConfigTable> table_if(std::string_view key) const;
  /// Array of tables ([[key]]).
  std::vector<ConfigTable> tables(std::string_view key) const;
  std::vector<ConfigTable> tables_if(std::string_view key) const;

  bool has(std::string_view key) const;
  /// The file this table was read from, as it was named.
  const std::string& file() const;
  /// Throws ConfigError for the first key that was never read, in this table and those read from it.
  void finish() const;
  /// An error at `key` (or at the table if there is no such key), for a part's own checks.
  ConfigError error(std::string_view key, std::string_view message) const;

  struct Node;
  explicit ConfigTable(std::shared_ptr<Node> node) : node_(std::move(node)) {}

 private:
  std::shared_ptr<Node> node_;
};

/// Root table of the file; ConfigError if it cannot be read or is not TOML.
ConfigTable load_config(const std::string& path);
/// The same from text; `name` stands for the file in messages.
ConfigTable parse_config(std::string_view text, const std::string& name);

/// The word of `legal` with the least edit distance to `word`, or "" if none is near: if more than
/// `edits_max` letters are wrong, by default one in three and one more.
std::string nearest_word(std::string_view word, const std::vector<std::string>& legal);
std::string nearest_word(std::string_view word, const std::vector<std::string>& legal, std::size_t edits_max);

}  // namespace trn
