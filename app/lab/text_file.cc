#include "app/lab/text_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "core/safe_file.h"

namespace trn {

namespace {

[[noreturn]] void cannot_write(const std::string& path, int error) {
  throw OutputError(fmt::format("{}: cannot write this file: {}", path, std::strerror(error)));
}

}  // namespace

void write_text_file(const std::string& path, const std::string& text) {
  errno = 0;
  std::ofstream out(path);
  out << text;
  if (!out.flush()) cannot_write(path, errno);
}

void check_text_file(const std::string& path) {
  if (path.empty()) return;
  constexpr mode_t kMode = 0666;  // as the user's mask leaves it
  constexpr int kLook = O_WRONLY | O_CLOEXEC | O_NOCTTY;
  if (const int made = ::open(path.c_str(), kLook | O_CREAT | O_EXCL, kMode); made >= 0) {
    ::close(made);
    ::unlink(path.c_str());
    return;
  }
  if (errno != EEXIST) cannot_write(path, errno);
  // A pipe whose reader comes later, and a link to a file that is made then, are none to complain of.
  const int there = ::open(path.c_str(), kLook | O_NONBLOCK);
  if (there >= 0)
    ::close(there);
  else if (errno != ENXIO && errno != ENOENT)
    cannot_write(path, errno);
}

void make_result_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw OutputError(fmt::format("{}: cannot make this folder: {}", path, error.message()));
}

}  // namespace trn
