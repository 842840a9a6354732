#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace trn {

/// A process that listens at a local socket, as far as this user can tell.
struct Listener {
  uid_t uid = 0;
  std::string text;  ///< for people: who it is
};

/// Who listens at the socket of this path. Nothing where nobody does: a socket's file stays when its process
/// is killed.
std::optional<Listener> listener_at(const std::string& path);

}  // namespace trn
