#include "app/import/ini_file.h"

#include <fmt/format.h>

#include <algorithm>

namespace trn {

namespace {

constexpr std::size_t kTextBytesMax = 4u << 20;
constexpr std::size_t kGapBytesMax = 80;  // of a line that was left out, in a note

// A value up to a comment behind it, which needs a blank before its mark.
std::string_view without_comment(std::string_view value) {
  for (std::size_t i = 1; i < value.size(); ++i)
    if ((value[i] == '#' || value[i] == ';') && (value[i - 1] == ' ' || value[i - 1] == '\t'))
      return trimmed(value.substr(0, i));
  return value;
}

bool is_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.' || c == ':' ||
           c == ' ';
  });
}

}  // namespace

std::vector<JoinedLine> joined_lines(std::string_view text, const std::string& file) {
  if (text.size() > kTextBytesMax)
    throw ImportError({file}, fmt::format("a file of more than {} bytes is no machine's", kTextBytesMax));
  std::vector<JoinedLine> lines;
  bool goes_on = false;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    ++number;
    if (const std::size_t zero = line.find('\0'); zero != std::string_view::npos)
      throw ImportError({file, number, static_cast<int>(zero) + 1}, "a byte of 0: this file is no text");
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
    while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const bool more = line.ends_with('\\');
    if (more) line.remove_suffix(1);
    if (goes_on)
      lines.back().text += " " + std::string(trimmed(line));
    else
      lines.push_back({std::string(line), number});
    goes_on = more;
    at = end + 1;
  }
  return lines;
}

IniFile IniFile::load(const std::string& path, const ImportReader& read) {
  IniFile file;
  file.path_ = path;
  file.read_file(path, {path}, false, read);
  return file;
}

void IniFile::include(std::string_view name, const ImportPlace& place, bool included,
                      const ImportReader& read) {
  if (name.empty())
    gaps_.push_back({place, "#INCLUDE", "there is no name of a file behind it"});
  else if (included)
    gaps_.push_back(
        {place, "#INCLUDE " + std::string(name), "a file that is included itself includes no other"});
  else
    read_file(beside(folder_of(path_), std::string(name)), place, true, read);
}

void IniFile::read_file(const std::string& path, const ImportPlace& named_at, bool included,
                        const ImportReader& read) {
  const std::optional<std::string> text = read(path);
  if (!text) throw ImportError(named_at, fmt::format("the file '{}' cannot be read", path));
  files_.push_back(path);
  constexpr std::string_view kInclude = "#INCLUDE";
  for (const JoinedLine& line : joined_lines(*text, path)) {
    const std::string_view content = trimmed(line.text);
    const int column = static_cast<int>(line.text.find_first_not_of(" \t")) + 1;
    const ImportPlace place{path, line.line, std::max(1, column)};
    const std::string_view first = content.substr(0, content.find_first_of(" \t"));
    if (first == kInclude)
      include(trimmed(content.substr(kInclude.size())), place, included, read);
    else if (!content.empty() && content[0] != '#' && content[0] != ';')
      read_line(line.text, place);
  }
}

void IniFile::open_section(std::string_view line, ImportPlace place) {
  const std::string_view content = trimmed(line);
  const std::size_t end = content.find(']');
  if (end == std::string_view::npos)
    throw ImportError(place, "a section has its name between [ and ], as in [JOINT_0]; the ] is missing");
  const std::string name(trimmed(content.substr(1, end - 1)));
  if (!is_name(name)) {
    ++place.column;
    throw ImportError(place, fmt::format("'{}' is no name of a section; [JOINT_0] would be right", name));
  }
  sections_.push_back({name, place});
}

void IniFile::read_line(std::string_view line, ImportPlace place) {
  if (line[place.column - 1] == '[') return open_section(line, place);
  const auto leave_out = [&](const char* why) {
    gaps_.push_back({place, std::string(trimmed(line).substr(0, kGapBytesMax)), why});
  };
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos)
    return leave_out(
        "this line is neither KEY = VALUE nor [SECTION] nor a comment (# or ;); LinuxCNC skips it, too");
  const std::string key(trimmed(line.substr(0, equals)));
  if (!is_name(key))
    return leave_out(
        "no key has this name; letters, digits and _ would be right, as in MAX_VELOCITY = 20; LinuxCNC does "
        "not look for it");
  if (sections_.empty())
    return leave_out("it stands before the first [SECTION], where LinuxCNC does not look");
  const std::string_view value = trimmed(line.substr(equals + 1));
  ImportPlace value_place = place;
  value_place.column =
      static_cast<int>(value.empty() ? equals + 2 : static_cast<std::size_t>(value.data() - line.data()) + 1);
  entries_.push_back({sections_.back().name, key, std::string(value), place, value_place});
}

const IniEntry* IniFile::find(std::string_view section, std::string_view key) const {
  const std::vector<const IniEntry*> found = all(section, key);
  return found.empty() ? nullptr : found.front();
}

std::vector<const IniEntry*> IniFile::all(std::string_view section, std::string_view key) const {
  std::vector<const IniEntry*> out;
  for (const IniEntry& entry : entries_)
    if (entry.section == section && entry.key == key) {
      entry.used = true;
      out.push_back(&entry);
    }
  return out;
}

bool IniFile::has_section(std::string_view section) const {
  return std::any_of(sections_.begin(), sections_.end(), [&](const Section& s) { return s.name == section; });
}

ImportPlace IniFile::place_of(std::string_view section) const {
  for (const Section& s : sections_)
    if (s.name == section) return s.place;
  return {path_};
}

std::optional<double> IniFile::number(std::string_view section, std::string_view key) const {
  const IniEntry* entry = find(section, key);
  if (!entry) return std::nullopt;
  const std::optional<double> value = whole_number_text(without_comment(entry->value));
  if (!value)
    throw ImportError(entry->value_place,
                      fmt::format("[{}]{} = '{}' is no number; one as 12.5 would be right", section, key,
                                  entry->value.substr(0, 40)));
  return value;
}

std::string IniFile::text(std::string_view section, std::string_view key) const {
  const IniEntry* entry = find(section, key);
  return entry ? std::string(without_comment(entry->value)) : "";
}

}  // namespace trn
