#include "interp/gcode/parameter_file.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <sstream>

#include "core/plain_file.h"
#include "core/safe_file.h"
#include "interp/gcode/error.h"
#include "interp/gcode/text/lexer.h"
#include "interp/move.h"

namespace trn {

namespace {

// Kept even when 0: homes, probe result, G92, coordinate systems.
bool is_required(int n) {
  return (n >= 5161 && n <= 5169) || (n >= 5181 && n <= 5189) || (n >= 5210 && n <= 5219) || n == 5220 ||
         (n >= 5221 && n <= 5390 && (n - 5221) % 20 <= 9);
}
bool is_kept(int n) {
  return (n >= parameter::kUserFirst && n <= parameter::kUserLast) || (n >= 5061 && n <= 5070) ||
         n == parameter::kTool;
}

}  // namespace

void parse_parameters(std::string_view text, const std::string& name, Parameters& parameters) {
  std::istringstream stream{std::string(text)};
  std::string line;
  std::int64_t last = 0;
  for (std::uint32_t number = 1; std::getline(stream, line); ++number) {
    while (!line.empty() && line.back() == '\r') line.pop_back();
    try {
      const std::size_t zero = line.find('\0');
      if (zero != std::string::npos) fail(GcodeErrorCode::kBinary, static_cast<std::uint32_t>(zero + 1), 0);
      Lexer lexer(line);
      if (lexer.peek() == '\0' || lexer.peek() == ';') continue;
      char* rest = nullptr;
      const long index = std::strtol(line.c_str(), &rest, 10);
      if (rest == line.c_str()) fail(GcodeErrorCode::kBadNumber, 1);
      const char* second = rest;
      const double value = std::strtod(second, &rest);
      if (rest == second || Lexer(rest).peek() != '\0' || !std::isfinite(value))
        fail(GcodeErrorCode::kBadNumber, static_cast<std::uint32_t>(second - line.c_str()) + 1);
      if (index < 1 || index > parameter::kMax) fail(GcodeErrorCode::kParameterRange, 1, index);
      // The numbers rise in such a file (RS274/NGC). One that falls back is a file that was put together from
      // two.
      if (index <= last) fail(GcodeErrorCode::kRepeatedWord, 1, index);
      last = index;
      parameters[static_cast<int>(index)] = value;
    } catch (const BlockError& error) {
      throw ProgramError(fmt::format("{}:{}:{}: {}", name, number, error.column, error.what()));
    }
  }
  double& system = parameters[parameter::kSystem];
  if (!(system >= 1 && system <= 9)) system = 1;
}

void load_parameters(const std::string& path, Parameters& parameters) {
  parse_parameters(read_text_file(path), path, parameters);
}

std::string parameters_text(const Parameters& parameters) {
  std::string text;
  for (int n = parameter::kUserFirst; n <= parameter::kMachineLast; ++n)
    if (is_required(n) || (is_kept(n) && parameters[n] != 0))
      text += fmt::format("{}\t{}\n", n, parameters[n]);
  return text;
}

void save_parameters(const std::string& path, const Parameters& parameters) {
  write_text_file(path, parameters_text(parameters));
}

std::string read_text_file(const std::string& path) {
  constexpr std::size_t kBytesMax = std::size_t{64} << 20;  // thousands of times a large table
  std::string all;
  try {
    all = read_plain_file(path, kBytesMax);
  } catch (const PlainFileError& error) {
    throw ProgramError(fmt::format("{}:1:1: {}", path.c_str(), error.what()));
  }
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (all.rfind(kByteOrderMark, 0) == 0) all.erase(0, kByteOrderMark.size());
  return all;
}

void write_text_file(const std::string& path, std::string_view text) {
  try {
    write_file_safely(path, text);
  } catch (const FileError& error) {
    throw ProgramError(error.what());
  }
}

}  // namespace trn
