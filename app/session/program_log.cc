#include "app/session/program_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "interp/gcode/error.h"
#include "interp/move.h"

namespace trn {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNameMax = 100;

std::string trimmed(const std::string& text) {
  const std::size_t from = text.find_first_not_of(" \t"), to = text.find_last_not_of(" \t");
  return from == std::string::npos ? "" : text.substr(from, to - from + 1);
}

// No folder of the program's choice, and nothing hidden: what a program writes must not become a start-up
// file.
bool is_plain(const std::string& name) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kNameMax && name[0] != '.' &&
         std::all_of(name.begin(), name.end(), fits);
}

}  // namespace

void ProgramLog::open(std::ofstream& out, const std::string& name, bool append, std::uint32_t line) {
  out.close();
  if (!is_plain(name))
    throw ProgramError(
        fmt::format("line {}: a log is named by letters, digits, '.', '_' and '-', and lies in the folder of "
                    "--logs: '{}'",
                    line, name));
  if (folder_.empty()) {
    if (!warned_ && warn_)
      warn_(fmt::format("line {}: {} is not written; --logs FOLDER says where to", line, name));
    warned_ = true;
    return;
  }
  const fs::path path = fs::path(folder_) / name;
  std::error_code none;
  fs::create_directories(folder_, none);
  const fs::file_status status = fs::symlink_status(path, none);
  const bool fits = !fs::exists(status) || fs::is_regular_file(status);
  if (fits) out.open(path, append ? std::ios::app : std::ios::trunc);
  if (!out.is_open())
    throw ProgramError(fmt::format("line {}: cannot write the log {}", line, path.string()));
}

void ProgramLog::take(const canon::Log& log, std::uint32_t line) {
  using What = canon::Log::What;
  switch (log.what) {
    case What::kLine:
      return write(log_, log.text, line);
    case What::kOpen:
    case What::kAppend:
      return open(log_, trimmed(log.text), log.what == What::kAppend, line);
    case What::kClose:
      return log_.close();
    case What::kProbeOpen:
      return open(contacts_, trimmed(log.text), false, line);
    case What::kProbeClose:
      return contacts_.close();
    case What::kProbePoint:
      return write(contacts_, log.text, line);
  }
}

// To the disk's cache at once: a measurement of an hour must not be lost with the process.
void ProgramLog::write(std::ofstream& out, const std::string& text, std::uint32_t line) {
  if (!out.is_open()) return;
  out << text << std::endl;
  if (!out) throw ProgramError(fmt::format("line {}: the log cannot be written any more", line));
}

}  // namespace trn
