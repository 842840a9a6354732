#pragma once

#include <stdexcept>
#include <string>

namespace trn {

/// A key file that cannot be used; what() says which, why and what to do.
struct KeyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The text of a regular file, no link, that nobody but this user (or root) owns, reads or writes: a secret.
/// KeyError with the reason where it is none, or is longer than 4 kB.
std::string read_private_file(const std::string& path);

}  // namespace trn
