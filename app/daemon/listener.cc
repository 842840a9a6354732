#include "app/daemon/listener.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "core/accounts.h"
#include "hal/local_socket.h"

namespace trn {

namespace {

// The kernel's list has the sockets of living processes alone, also of those that this user may not use.
bool is_listed(const std::string& path) {
  std::ifstream list("/proc/self/net/unix");
  for (std::string row; std::getline(list, row);)
    if (row.size() > path.size() && row.ends_with(path) && row[row.size() - path.size() - 1] == ' ')
      return true;
  return false;
}

// Of the file, or of the folder in which this user may not look.
uid_t owner_of(const std::string& path) {
  struct stat info {};
  if (lstat(path.c_str(), &info) == 0) return info.st_uid;
  const std::string folder = std::filesystem::path(path).parent_path();
  return lstat(folder.c_str(), &info) == 0 ? info.st_uid : 0;
}

}  // namespace

std::optional<Listener> listener_at(const std::string& path) {
  try {
    const LocalClient other(path);
    return Listener{other.server().uid, other.server().text()};
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::permission_denied || !is_listed(path)) return std::nullopt;
  } catch (const std::runtime_error&) {  // no path for a socket
    return std::nullopt;
  }
  const uid_t owner = owner_of(path);
  return Listener{owner,
                  fmt::format("a process of user {}, whose socket this user may not use,", user_name(owner))};
}

}  // namespace trn
