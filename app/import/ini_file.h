#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/import/import_place.h"

namespace trn {

/// One line KEY = VALUE of an INI file of LinuxCNC. The same key may be there many times.
struct IniEntry {
  std::string section = {}, key = {}, value = {};
  ImportPlace key_place = {}, value_place = {};
  mutable bool used = false;  ///< somebody has asked for it: what is left is told as not carried over
  std::string text() const { return "[" + section + "]" + key + " = " + value; }
};

/// An INI file of LinuxCNC with what it includes: sections, repeated keys, lines that go on behind a
/// backslash, `#INCLUDE FILE`, comments with # or ; at the beginning of a line. Upper and lower case differ.
class IniFile {
 public:
  /// A line that is nothing of this is a gap, because LinuxCNC skips it and starts. A file that is included
  /// includes no other, as in LinuxCNC: such a line is a gap, too. ImportError with file, line and column for
  /// a section without its ] or without a name, and for a file that cannot be read.
  static IniFile load(const std::string& path, const ImportReader& read);

  /// The first of its key, as LinuxCNC takes it; null if there is none. It counts as used, and so do those of
  /// the same key behind it: they mean nothing.
  const IniEntry* find(std::string_view section, std::string_view key) const;
  /// All of its key, in the file's order; they count as used.
  std::vector<const IniEntry*> all(std::string_view section, std::string_view key) const;
  bool has_section(std::string_view section) const;
  /// Where the section begins, or the file if there is none.
  ImportPlace place_of(std::string_view section) const;

  /// The number of a key. ImportError at its value if it is none, with what would be right.
  std::optional<double> number(std::string_view section, std::string_view key) const;
  /// The text of a key, without a comment behind it; "" if there is none.
  std::string text(std::string_view section, std::string_view key) const;

  const std::vector<IniEntry>& entries() const { return entries_; }
  const std::string& path() const { return path_; }
  const std::vector<ImportGap>& gaps() const { return gaps_; }
  /// Every file that was read.
  const std::vector<std::string>& files() const { return files_; }

 private:
  struct Section {
    std::string name;
    ImportPlace place;
  };

  void read_file(const std::string& path, const ImportPlace& named_at, bool included,
                 const ImportReader& read);
  void include(std::string_view name, const ImportPlace& place, bool included, const ImportReader& read);
  void read_line(std::string_view line, ImportPlace place);
  void open_section(std::string_view line, ImportPlace place);

  std::string path_;
  std::vector<std::string> files_;
  std::vector<Section> sections_;
  std::vector<IniEntry> entries_;
  std::vector<ImportGap> gaps_;
};

/// The lines of `text`, each with the number of its first one; lines that end with a backslash are put
/// together, with a blank between.
struct JoinedLine {
  std::string text;
  int line = 1;
};
std::vector<JoinedLine> joined_lines(std::string_view text, const std::string& file);

}  // namespace trn
