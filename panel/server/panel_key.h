#pragma once

#include <string>
#include <string_view>

namespace trn {

/// The key that a page needs before the panel tells or obeys it: whoever has it operates the machine with the
/// rights of the panel's own user. It leaves the memory with the object.
class PanelKey {
 public:
  /// 128 random bits. KeyError where libsodium does not work.
  static PanelKey make();
  /// The first line of the file: 32 to 128 hexadecimal digits. KeyError, also if others than this user can
  /// read the file.
  static PanelKey read(const std::string& path);

  ~PanelKey();
  PanelKey(const PanelKey&) = default;
  PanelKey& operator=(const PanelKey&) = delete;

  /// Takes as long for a wrong key of the right length as for the right one.
  bool is(std::string_view text) const;
  /// Hexadecimal digits.
  const std::string& text() const { return text_; }

 private:
  explicit PanelKey(std::string_view text) : text_(text) {}

  std::string text_;
};

}  // namespace trn
