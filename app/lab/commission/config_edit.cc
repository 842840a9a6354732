#include "app/lab/commission/config_edit.h"

#include <fmt/format.h>

#include <sstream>
#include <stdexcept>
#include <vector>

namespace trn {

namespace {

std::string without_space(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t"), end = line.find_last_not_of(" \t\r");
  return begin == std::string::npos ? "" : line.substr(begin, end - begin + 1);
}

bool is_header(const std::string& line, const std::string& header) {
  const std::string bare = without_space(line);
  return bare.compare(0, header.size(), header) == 0 &&
         (bare.size() == header.size() || bare.find_first_not_of(" \t", header.size()) == bare.find('#'));
}

bool sets(const std::string& line, const std::string& key) {
  const std::string bare = without_space(line);
  const std::size_t sign = bare.find('=');
  return sign != std::string::npos && without_space(bare.substr(0, sign)) == key;
}

// What stands behind the value, with the space before it. No value that is written here has a # in it.
std::string comment_of(const std::string& line) {
  const std::size_t at = line.find('#');
  if (at == std::string::npos) return "";
  const std::size_t end = line.find_last_not_of(" \t", at - 1);
  return line.substr(end + 1);
}

}  // namespace

std::string with_key(const std::string& text, const std::string& header, int number, const std::string& key,
                     const std::string& value) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  std::size_t at = 0;
  for (; at < lines.size(); ++at)
    if (is_header(lines[at], header) && number-- == 0) break;
  if (at == lines.size()) throw std::runtime_error(fmt::format("the config has no such table {}", header));
  std::size_t last = at;
  bool done = false;
  for (std::size_t i = at + 1; i < lines.size() && without_space(lines[i]).substr(0, 1) != "["; ++i) {
    const std::string bare = without_space(lines[i]);
    if (!bare.empty() && bare[0] != '#') last = i;
    if (!sets(lines[i], key)) continue;
    lines[i] = fmt::format("{} = {}{}", key, value, comment_of(lines[i]));
    done = true;
  }
  if (!done)
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(last) + 1, fmt::format("{} = {}", key, value));
  std::string out;
  for (const std::string& line : lines) out += line + "\n";
  return out;
}

}  // namespace trn
