#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace trn {

/// A place in one of the files that are imported; line and column count from 1.
struct ImportPlace {
  std::string file = {};
  int line = 1;
  int column = 1;
  std::string text() const { return file + ":" + std::to_string(line) + ":" + std::to_string(column); }
};

/// Text that cannot be read, or says what cannot be; what() is "file:line:column: message".
struct ImportError : std::runtime_error {
  ImportError(const ImportPlace& place, const std::string& message)
      : std::runtime_error(place.text() + ": " + message) {}
  /// The message has its place already.
  explicit ImportError(const std::string& located) : std::runtime_error(located) {}
};

/// A machine that there is no counterpart for; what() is as that of an ImportError.
struct ImportRefusal : std::runtime_error {
  ImportRefusal(const ImportPlace& place, const std::string& message)
      : std::runtime_error(place.text() + ": " + message) {}
};

/// Something that was not read, or has no value, and what that means.
struct ImportGap {
  ImportPlace place = {};
  std::string what = {}, why = {};
};

/// Gives the whole text of the file `path`; nothing if there is none that can be read.
using ImportReader = std::function<std::optional<std::string>(const std::string& path)>;

/// Folder of `path` with a "/" behind it; "" for a bare name.
std::string folder_of(const std::string& path);
/// `name` as seen from `folder`: a whole path stays, "~" is left alone.
std::string beside(const std::string& folder, const std::string& name);

/// A number that `text` consists of; nothing for anything else, for infinity too.
std::optional<double> whole_number_text(std::string_view text);

/// Without blanks at both ends.
std::string_view trimmed(std::string_view text);

}  // namespace trn
