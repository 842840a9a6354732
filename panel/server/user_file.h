#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "app/client/command_rights.h"

namespace trn {

/// A file of users that cannot be used or changed; what() says which, where and why.
struct UserError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Somebody who may log in to the operator's page.
struct User {
  std::string name;
  Role role = Role::kLook;
  std::string hash;  ///< of the password: Argon2id, as libsodium writes it
};

/// The users of a file that nobody but this user can read, one a line: NAME:ROLE:HASH. UserError with file
/// and line.
std::vector<User> read_users(const std::string& path);

/// Adds one; a file that is not there is made with mode 0600, for the owner of its folder. UserError where
/// the name is taken or none, or the password is shorter than 10 letters.
void add_user(const std::string& path, const std::string& name, Role role, std::string_view password);
/// UserError where there is no such user.
void remove_user(const std::string& path, const std::string& name);

/// True if the hash was made of this password. Takes about a tenth of a second and 64 MB, on purpose.
bool is_password(const std::string& hash, std::string_view password);
/// A hash that no password has made, and that takes as long to compare.
std::string hash_of_nobody();

}  // namespace trn
