#include "app/daemon/read_files.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <utility>

#include "app/client/running_daemons.h"
#include "interp/move.h"

namespace trn {

namespace {

// "" where there is none.
std::string stamp_of(const std::string& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) return "";
  return fmt::format("{} {} {} {}.{:09} {}.{:09}", info.st_dev, info.st_ino, info.st_size,
                     info.st_mtim.tv_sec, info.st_mtim.tv_nsec, info.st_ctim.tv_sec, info.st_ctim.tv_nsec);
}

}  // namespace

ReadFiles::ReadFiles(const ReadFiles& other) : files_(other.files()) {}

ReadFiles& ReadFiles::operator=(const ReadFiles& other) {
  if (this == &other) return *this;
  std::map<std::string, File> files = other.files();
  const std::lock_guard lock(mutex_);
  files_ = std::move(files);
  return *this;
}

std::map<std::string, ReadFiles::File> ReadFiles::files() const {
  const std::lock_guard lock(mutex_);
  return files_;
}

void ReadFiles::clear() {
  const std::lock_guard lock(mutex_);
  files_.clear();
}

void ReadFiles::note(const std::string& path) {
  {
    const std::lock_guard lock(mutex_);
    if (files_.contains(path)) return;
  }
  const std::string stamp = stamp_of(path);
  const std::string mark = file_mark(path);
  const std::lock_guard lock(mutex_);
  files_.insert({path, {stamp, mark}});
}

// One that was written anew with the same content is the same.
void ReadFiles::check() const {
  for (const auto& [path, file] : files()) {
    const std::string stamp = stamp_of(path);
    if (stamp == file.stamp || (!stamp.empty() && file_mark(path) == file.mark)) continue;
    throw ProgramError(
        stamp.empty()
            ? fmt::format("{} is not there any more; put it back, or 'load' another program", path)
            : fmt::format("{} has changed on disk since it was loaded; 'load' the program again", path));
  }
}

std::string ReadFiles::mark(const std::string& path) const {
  const std::map<std::string, File> known = files();
  const auto found = known.find(path);
  return found == known.end() ? "" : found->second.mark;
}

}  // namespace trn
