#include "app/cli/browser.h"

#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>

namespace trn {

namespace {

bool has_display() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"})
    if (const char* value = std::getenv(name); value && *value) return true;
  return false;
}

}  // namespace

bool open_in_browser(const std::string& path) {
  if (isatty(STDOUT_FILENO) == 0 || !has_display()) return false;
  std::string program = "xdg-open", file = std::filesystem::absolute(path);
  std::array<char*, 3> words = {program.data(), file.data(), nullptr};
  posix_spawn_file_actions_t silent;
  posix_spawn_file_actions_init(&silent);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&silent, fd, "/dev/null", O_RDWR, 0);
  pid_t child = 0;
  const bool begun = posix_spawnp(&child, program.c_str(), &silent, nullptr, words.data(), environ) == 0;
  posix_spawn_file_actions_destroy(&silent);
  return begun;
}

}  // namespace trn
