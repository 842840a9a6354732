#pragma once

#include <unistd.h>

#include <cstddef>
#include <stdexcept>
#include <string>

namespace trn {

/// A key file that cannot be used; what() says which, why and what to do.
struct KeyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The text of a regular file, no link, that nobody but `owner` (or root) owns, reads or writes: a secret.
/// KeyError with the reason where it is none, or has not less than `bytes_max` bytes.
std::string read_private_file(const std::string& path, std::size_t bytes_max = 4096, uid_t owner = geteuid());

}  // namespace trn
