#include "core/accounts.h"

#include <grp.h>
#include <pwd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <memory>
#include <vector>

namespace trn {

namespace {

constexpr std::size_t kBytes = 1024, kBytesMax = std::size_t{1} << 20;  // of one entry; a group may be large

/// Calls `ask` with room for the entry's texts, and with more where that is not enough; its error.
template <typename Ask>
int with_room(std::vector<char>& room, Ask ask) {
  int error = ERANGE;
  for (room.resize(kBytes); error == ERANGE && room.size() <= kBytesMax; room.resize(4 * room.size())) {
    error = ask();
    if (error != ERANGE) break;
  }
  return error;
}

}  // namespace

std::string user_name(uid_t uid) {
  const std::unique_ptr<FILE, int (*)(FILE*)> users(std::fopen("/etc/passwd", "re"), std::fclose);
  std::vector<char> room;
  passwd entry{};
  passwd* user = nullptr;
  const auto next = [&] { return fgetpwent_r(users.get(), &entry, room.data(), room.size(), &user); };
  while (users && with_room(room, next) == 0 && user)
    if (user->pw_uid == uid) return user->pw_name;
  return std::to_string(uid);
}

std::string home_folder() {
  std::vector<char> room;
  passwd entry{};
  passwd* user = nullptr;
  with_room(room, [&] { return getpwuid_r(geteuid(), &entry, room.data(), room.size(), &user); });
  return user && user->pw_dir && user->pw_dir[0] == '/' ? user->pw_dir : "";
}

std::optional<gid_t> group_id(const std::string& name) {
  std::vector<char> room;
  group entry{};
  group* found = nullptr;
  with_room(room, [&] { return getgrnam_r(name.c_str(), &entry, room.data(), room.size(), &found); });
  return found ? std::optional(found->gr_gid) : std::nullopt;
}

}  // namespace trn
