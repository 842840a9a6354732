#include "panel/server/user_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <optional>

#include "app/client/private_file.h"
#include "app/client/signing_key.h"
#include "core/safe_file.h"

namespace trn {

namespace {

constexpr std::size_t kFileBytesMax = 1 << 20, kPasswordMin = 10, kPasswordMax = 1000;

void begin_sodium() {
  static const bool ready = sodium_init() >= 0;
  if (!ready) throw UserError("libsodium does not work on this host");
}

User user_of(std::string_view line, const std::string& where) {
  const std::size_t first = line.find(':'), second = line.find(':', std::min(first, line.size() - 1) + 1);
  if (first == std::string_view::npos || second == std::string_view::npos)
    throw UserError(fmt::format("{}: no NAME:ROLE:HASH, as 'trunnion panel user add' writes it", where));
  const std::optional<Role> role = role_called(line.substr(first + 1, second - first - 1));
  if (!role) throw UserError(fmt::format("{}: the role must be look, operate or set up", where));
  User user{std::string(line.substr(0, first)), *role, std::string(line.substr(second + 1))};
  if (!refuse_key_name(user.name).empty() || !user.hash.starts_with("$argon2id$") ||
      user.hash.size() >= crypto_pwhash_STRBYTES)
    throw UserError(fmt::format("{}: no user, as 'trunnion panel user add' writes one", where));
  return user;
}

std::string text_of(const std::vector<User>& users) {
  std::string text;
  for (const User& user : users)
    text += fmt::format("{}:{}:{}\n", user.name, to_string(user.role), user.hash);
  return text;
}

std::string hash_of(std::string_view password) {
  begin_sodium();
  std::array<char, crypto_pwhash_STRBYTES> hash{};
  if (crypto_pwhash_str(hash.data(), password.data(), password.size(), crypto_pwhash_OPSLIMIT_INTERACTIVE,
                        crypto_pwhash_MEMLIMIT_INTERACTIVE) != 0)
    throw UserError("the password's hash needs 64 MB of memory, which are not there");
  return hash.data();
}

std::filesystem::path folder_of(const std::string& path) {
  return std::filesystem::absolute(path).parent_path();
}

// Root keeps the file of a service, which belongs to the user of that.
uid_t owner_of(const std::string& path) {
  struct stat folder {};
  const bool others = geteuid() == 0 && stat(folder_of(path).c_str(), &folder) == 0;
  return others ? folder.st_uid : geteuid();
}

void make_file(const std::string& path) {
  std::error_code none;
  std::filesystem::create_directories(folder_of(path), none);
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (file < 0 && errno != EEXIST) throw UserError(fmt::format("{}: {}", path, std::strerror(errno)));
  if (file < 0) return;
  const bool given = geteuid() != 0 || fchown(file, owner_of(path), static_cast<gid_t>(-1)) == 0;
  ::close(file);
  if (!given) throw UserError(fmt::format("{}: cannot be given to the owner of its folder", path));
}

void write_users(const std::string& path, const std::vector<User>& users) {
  try {
    write_file_safely(path, text_of(users));
  } catch (const FileError& error) {
    throw UserError(error.what());
  }
}

auto find_user(std::vector<User>& users, const std::string& name) {
  return std::find_if(users.begin(), users.end(), [&](const User& user) { return user.name == name; });
}

std::string text_of_file(const std::string& path) {
  try {
    return read_private_file(path, kFileBytesMax, owner_of(path));
  } catch (const KeyError& error) {
    throw UserError(error.what());
  }
}

}  // namespace

std::vector<User> read_users(const std::string& path) {
  const std::string text = text_of_file(path);
  std::vector<User> users;
  std::size_t number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    const std::string where = fmt::format("{}:{}", path, ++number);
    if (line.empty()) continue;
    User user = user_of(line, where);
    if (find_user(users, user.name) != users.end())
      throw UserError(fmt::format("{}: there is a user '{}' above", where, user.name));
    users.push_back(std::move(user));
  }
  return users;
}

void add_user(const std::string& path, const std::string& name, Role role, std::string_view password) {
  if (!refuse_key_name(name).empty())
    throw UserError(fmt::format("'{}' is no name: 1 to 40 letters, digits and . _ @ -", name));
  if (password.size() < kPasswordMin || password.size() > kPasswordMax)
    throw UserError(fmt::format("a password has {} to {} letters", kPasswordMin, kPasswordMax));
  make_file(path);
  std::vector<User> users = read_users(path);
  if (find_user(users, name) != users.end())
    throw UserError(fmt::format("{}: there is a user '{}'; remove that one first", path, name));
  users.push_back({name, role, hash_of(password)});
  write_users(path, users);
}

void remove_user(const std::string& path, const std::string& name) {
  std::vector<User> users = read_users(path);
  const auto found = find_user(users, name);
  if (found == users.end()) throw UserError(fmt::format("{}: there is no user '{}'", path, name));
  users.erase(found);
  write_users(path, users);
}

bool is_password(const std::string& hash, std::string_view password) {
  begin_sodium();
  return crypto_pwhash_str_verify(hash.c_str(), password.data(), password.size()) == 0;
}

std::string hash_of_nobody() {
  std::array<unsigned char, 32> random{};
  begin_sodium();
  randombytes_buf(random.data(), random.size());
  return hash_of({reinterpret_cast<const char*>(random.data()), random.size()});
}

}  // namespace trn
