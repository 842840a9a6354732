#include "app/import/variable_file.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>

#include "app/import/import_place.h"

namespace trn {

namespace {

struct Variable {
  long number = 0;
  std::string value = {};
  bool more = false;  ///< text behind the value
};

/// A plus sign is no part of a number for from_chars, and one for LinuxCNC.
std::string_view without_plus(std::string_view text) {
  const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+';
  return text.substr(plus ? 1 : 0);
}

// As sscanf("%d %lf") of LinuxCNC: two numbers at the line's beginning, and whatever may follow.
std::optional<Variable> read_variable(std::string_view line) {
  Variable out;
  const std::string_view first = without_plus(trimmed(line));
  const auto [behind, bad] = std::from_chars(first.data(), first.data() + first.size(), out.number);
  if (bad != std::errc()) return std::nullopt;
  const std::string_view rest =
      without_plus(trimmed(first.substr(static_cast<std::size_t>(behind - first.data()))));
  double value = 0;
  const auto [end, wrong] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (wrong != std::errc() || !std::isfinite(value)) return std::nullopt;
  const auto length = static_cast<std::size_t>(end - rest.data());
  out.value = rest.substr(0, length);
  out.more = length < rest.size();
  return out;
}

}  // namespace

std::string readable_variables(std::string_view text, const std::string& path,
                               std::vector<LeftOutLine>& left_out) {
  std::string out;
  long last = 0;
  std::uint32_t number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end), content = trimmed(line);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    const std::optional<Variable> variable = read_variable(line);
    // A byte of 0 is told by the parser: this is no text.
    if (line.find('\0') != std::string_view::npos) {
      out += std::string(line) + "\n";
      continue;
    }
    if (!content.empty() && (!variable || variable->more))
      left_out.push_back({number, 1, std::string(content),
                          variable
                              ? "LinuxCNC reads two numbers of a line; what follows was left out"
                              : "this line is no parameter, as '5221 12.5' is one; LinuxCNC passes over it, "
                                "and it was left out"});
    if (variable) {
      if (variable->number >= 1 && variable->number <= last)
        throw ImportError(
            {path, static_cast<int>(number), 1},
            variable->number == last
                ? fmt::format("parameter {} is there twice; LinuxCNC refuses such a file as well: take "
                              "one of both lines away",
                              last)
                : fmt::format("parameter {} stands below {}; the numbers must rise, and LinuxCNC refuses "
                              "such a file as well: sort its lines",
                              variable->number, last));
      last = variable->number;
      out += fmt::format("{}\t{}", variable->number, variable->value);
    }
    out += "\n";
  }
  return out;
}

}  // namespace trn
