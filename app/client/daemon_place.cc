#include "app/client/daemon_place.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "core/accounts.h"

namespace trn {

namespace {

constexpr const char* kSystemFolder = "/run/trunnion";

std::string of_environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? std::string(value).substr(0, std::string_view(value).find(':')) : std::string();
}

// "" if the folder is private and can be written; otherwise why not.
std::string refuse_folder(const std::string& path) {
  struct stat info {};
  if (lstat(path.c_str(), &info) != 0) return std::strerror(errno);
  if (!S_ISDIR(info.st_mode)) return "it is no folder of its own";
  const bool systems = path == kSystemFolder && (info.st_uid == 0 || geteuid() == 0);  // root made it
  if (info.st_uid != geteuid() && !systems) return "it belongs to another user";
  if (info.st_mode & (S_IWGRP | S_IWOTH)) return "others can write it";
  return access(path.c_str(), W_OK | X_OK) == 0 ? "" : std::strerror(errno);
}

std::string make_and_judge(const std::string& path) {
  std::error_code ignored;  // told by the judgement
  const std::string home = home_folder();
  if (!home.empty() && path.rfind(home + "/", 0) == 0)
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  mkdir(path.c_str(), 0750);
  return refuse_folder(path);
}

}  // namespace

std::vector<std::string> lock_folders() {
  std::vector<std::string> folders{of_environment("RUNTIME_DIRECTORY"), kSystemFolder,
                                   of_environment("XDG_RUNTIME_DIR")};
  const std::string home = home_folder();
  folders.push_back(home.empty() ? "" : home + "/.local/state/trunnion");
  folders.push_back(fmt::format("/tmp/trunnion-{}", geteuid()));
  std::erase(folders, "");
  return folders;
}

std::string private_folder(const std::vector<std::string>& folders) {
  std::string refused;
  for (const std::string& folder : folders) {
    const std::string why = make_and_judge(folder);
    if (why.empty()) return folder;
    refused += fmt::format("\n  {}: {}", folder, why);
  }
  throw std::runtime_error("no private folder for the lock file of the machine; set XDG_RUNTIME_DIR to one:" +
                           refused);
}

std::string socket_name(const std::string& machine) { return fmt::format("trunnion-{}.sock", machine); }

namespace {

std::vector<std::string> socket_folders() {
  std::vector<std::string> folders = lock_folders();
  std::error_code none;  // no service has ever run here
  for (const auto& entry : std::filesystem::directory_iterator(kSystemFolder, none))
    if (entry.is_directory(none)) folders.push_back(entry.path());
  return folders;
}

}  // namespace

std::vector<std::string> sockets_to_try(const AccessConfig& config, const std::string& machine) {
  if (!config.socket.empty()) return {config.socket};
  std::vector<std::string> paths;
  for (const std::string& folder : socket_folders())
    paths.push_back(fmt::format("{}/{}", folder, socket_name(machine)));
  return paths;
}

std::vector<SocketPlace> sockets_there() {
  constexpr std::string_view kHead = "trunnion-", kTail = ".sock";
  std::vector<SocketPlace> out;
  for (const std::string& folder : socket_folders()) {
    std::error_code none;
    std::vector<SocketPlace> here;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
      const std::string name = entry.path().filename();
      if (name.size() <= kHead.size() + kTail.size() || !name.starts_with(kHead) || !name.ends_with(kTail))
        continue;
      here.push_back({name.substr(kHead.size(), name.size() - kHead.size() - kTail.size()), entry.path()});
    }
    std::sort(here.begin(), here.end(), [](const auto& a, const auto& b) { return a.machine < b.machine; });
    out.insert(out.end(), here.begin(), here.end());
  }
  return out;
}

bool is_trusted_user(uid_t user) {
  if (user == 0 || user == geteuid()) return true;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(kSystemFolder, none)) {
    struct stat info {};
    if (lstat(entry.path().c_str(), &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == user) return true;
  }
  return false;
}

std::string safety_socket(const std::string& socket) { return socket + ".safety"; }

Connection connect_to_daemon(const AccessConfig& config, const std::string& machine, bool safety) {
  Connection out;
  for (const std::string& first : sockets_to_try(config, machine)) {
    const std::string path = safety ? safety_socket(first) : first;
    try {
      auto link = std::make_unique<LocalClient>(path);
      if (is_trusted_user(link->server().uid)) return {std::move(link), ""};
      out.refused =
          fmt::format("; {} is a socket of {}, whom nobody here trusts", path, link->server().text());
    } catch (const std::system_error& error) {
      if (error.code() != std::errc::permission_denied) continue;
      out.refused = fmt::format(
          "; this user may not use {}: that needs group '{}' (usermod -aG {} USER, then log in anew)", path,
          config.look, config.look);
    }
  }
  return out;
}

}  // namespace trn
