#include "tests/world/disk.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "tests/world/promises.h"
#include "tests/world/scheduler.h"

namespace trn::world {

namespace {

Disk* g_disk = nullptr;
std::string g_folder;

std::string read_raw(const std::string& path) {
  std::string text;
  const long fd = raw_call(SYS_open, reinterpret_cast<long>(path.c_str()), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return text;
  std::array<char, 4096> part;
  for (long got = 1; got > 0;) {
    got = raw_call(SYS_read, fd, reinterpret_cast<long>(part.data()), static_cast<long>(part.size()));
    if (got > 0) text.append(part.data(), static_cast<std::size_t>(got));
  }
  raw_call(SYS_close, fd);
  return text;
}

bool is_folder(const std::string& path, const std::string& folder) {
  return path + "/" == folder || path == folder;
}

}  // namespace

void Disk::begin(const std::string& folder, const DiskMalice& malice, std::uint64_t seed) {
  g_disk = new Disk;
  g_disk->folder_ = g_folder = folder + "/";
  g_disk->malice_ = malice;
  g_disk->random_.seed(seed);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) g_disk->file_of(entry.path());
}

Disk* Disk::of(const char* path) {
  if (!g_disk || !path) return nullptr;
  const std::string_view text = path;
  return text.starts_with(g_folder) || is_folder(path, g_folder) ? g_disk : nullptr;
}

Disk* Disk::of(int fd) { return g_disk && g_disk->open_.contains(fd) ? g_disk : nullptr; }

int Disk::trouble(const char* call) {
  Scheduler* const scheduler = Scheduler::current();
  if (malice_.slow_ns > 0 && scheduler)
    scheduler->sleep_until(scheduler->now_ns() + static_cast<std::int64_t>(
                                                     random_() % static_cast<std::uint64_t>(malice_.slow_ns)),
                           call);
  if (static_cast<double>(random_() >> 11) * 0x1p-53 >= malice_.fault_share) return 0;
  constexpr std::array<int, 3> kErrors = {ENOSPC, EROFS, EIO};
  const int error = kErrors[random_() % kErrors.size()];
  Chronicle::note(fmt::format("harm: {} fails: {}", call, std::strerror(error)));
  return error;
}

std::size_t Disk::share_of(std::size_t size) {
  if (size < 2 || static_cast<double>(random_() >> 11) * 0x1p-53 >= malice_.torn_share) return size;
  return 1 + random_() % (size - 1);
}

// A file that was there before the session is on the disk.
Disk::FilePtr Disk::file_of(const std::string& path) {
  FilePtr& file = names_[path];
  if (!file) {
    file = std::make_shared<File>();
    file->safe = read_raw(path);
    safe_names_[path] = file;
  }
  return file;
}

void Disk::opened(const char* path, int fd, int flags) {
  if (is_folder(path, folder_)) {
    open_[fd] = {nullptr, path};
    return;
  }
  const bool makes = (flags & O_CREAT) && (flags & O_EXCL);
  if (makes) {
    names_[path] = std::make_shared<File>();
    changes_.push_back({"", path, names_[path]});
  }
  open_[fd] = {file_of(path), path};
}

void Disk::written(int fd) { open_[fd].file->dirty = true; }

void Disk::synced(int fd) {
  const Open& open = open_[fd];
  if (open.file) {
    open.file->safe = read_raw(open.path);
    open.file->dirty = false;
    return;
  }
  changes_.clear();
  safe_names_ = names_;
}

void Disk::renamed(const std::string& from, const std::string& to) {
  const FilePtr file = file_of(from);
  file_of(to);
  names_.erase(from);
  names_[to] = file;
  changes_.push_back({from, to, file});
  for (auto& [fd, open] : open_)
    if (open.file == file) open.path = to;
}

void Disk::unlinked(const std::string& path) {
  if (names_.erase(path) > 0) changes_.push_back({path, "", nullptr});
}

Disk::Content Disk::after_power_cut(const std::string& path) {
  auto names = safe_names_;
  const std::size_t kept = random_() % (changes_.size() + 1);
  for (std::size_t i = 0; i < kept; ++i) {
    names.erase(changes_[i].gone);
    if (!changes_[i].made.empty()) names[changes_[i].made] = changes_[i].file;
  }
  const auto found = names.find(path);
  if (found == names.end() || !found->second) return {};
  const File& file = *found->second;
  if (!file.dirty) return {true, file.safe};
  std::string now = file.safe;
  for (const auto& [name, live] : names_)
    if (live == found->second) now = read_raw(name);
  switch (random_() % 3) {
    case 0:
      return {true, file.safe};
    case 1:
      return {true, now.substr(0, now.empty() ? 0 : random_() % now.size())};
    default:
      return {true, now};
  }
}

}  // namespace trn::world
