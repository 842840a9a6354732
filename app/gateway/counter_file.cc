#include "app/gateway/counter_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "core/plain_file.h"
#include "core/safe_file.h"

namespace trn {

namespace {

constexpr const char* kHead = "counters of machine";
constexpr const char* kEnd = "end";
constexpr std::size_t kBytesMax = std::size_t{1} << 20;

std::string text_of(const std::string& path) {
  try {
    return read_plain_file(path, kBytesMax);
  } catch (const PlainFileError& error) {
    throw std::runtime_error(fmt::format("{}: {}", path, error.what()));
  }
}

}  // namespace

CounterFile::CounterFile(std::string path, std::string machine)
    : path_(std::move(path)), machine_(std::move(machine)) {
  lock();
  try {
    read();
    check_file_writable(path_);
  } catch (...) {
    close(lock_);
    throw;
  }
}

CounterFile::~CounterFile() { close(lock_); }

void CounterFile::lock() {
  const std::string name = path_ + ".lock";
  lock_ = open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (lock_ < 0) throw std::runtime_error(fmt::format("{}: {}", name, std::strerror(errno)));
  if (flock(lock_, LOCK_EX | LOCK_NB) == 0) return;
  close(lock_);
  throw std::runtime_error(fmt::format("another gateway has {}; stop that one first", path_));
}

// Nothing but the whole file as it was written: a counter that is missing would let old commands in again.
void CounterFile::read() {
  new_ = !std::filesystem::exists(std::filesystem::symlink_status(path_));
  if (new_) return;
  std::istringstream file(text_of(path_));
  std::string line;
  const bool ours = std::getline(file, line) && line == fmt::format("{} {}", kHead, machine_);
  bool sound = ours, ended = false;
  while (sound && !ended && std::getline(file, line)) {
    std::istringstream words(line);
    std::string key, rest;
    std::int64_t counter = 0;
    ended = line == kEnd;
    sound = ended || ((words >> key >> counter) && !(words >> rest) && counter > 0);
    if (sound && !ended) counters_[key] = counter;
  }
  if (sound && ended && file.peek() == std::istringstream::traits_type::eof()) return;
  throw std::runtime_error(fmt::format(
      "{}: these are no counters of machine '{}'. Without them commands that were sent before can be "
      "sent again by anybody who heard them: give all keys new ones ('trunnion key make'), then remove "
      "the file",
      path_, machine_));
}

std::int64_t CounterFile::last(const std::string& key) const {
  const auto found = counters_.find(key);
  return found == counters_.end() ? 0 : found->second;
}

void CounterFile::raise(const std::string& key, std::int64_t counter) {
  std::int64_t& last = counters_[key];
  last = std::max(last, counter);
}

void CounterFile::save() const {
  std::string text = fmt::format("{} {}\n", kHead, machine_);
  for (const auto& [key, counter] : counters_) text += fmt::format("{} {}\n", key, counter);
  write_file_safely(path_, text + kEnd + "\n");
}

}  // namespace trn
