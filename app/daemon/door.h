#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "app/client/access_config.h"
#include "app/client/daemon_place.h"
#include "app/daemon/access.h"
#include "app/daemon/process_lock.h"
#include "hal/local_socket.h"

namespace trn {

/// What the daemon opens first, while it still may: the lock of its machine and the socket for its clients.
class Door {
 public:
  /// std::runtime_error with what is wrong and how to mend it: a second daemon, no place for lock or socket.
  Door(const std::string& machine, const AccessConfig& config);

  LocalServer& clients() { return clients_; }
  const LocalServer& clients() const { return clients_; }
  /// For clients that find no room there (safety_socket); null: none could be made.
  LocalServer* safety() { return safety_ ? &*safety_ : nullptr; }
  const AccessRules& access() const { return access_; }

  /// Once a second looks whether clients still find the sockets, and makes one anew that somebody has
  /// removed. What keeps them out all the same, once each time; "": nothing does.
  std::string look(std::chrono::steady_clock::time_point now);

 private:
  ProcessLock lock_;
  AccessRules access_;
  LocalServer clients_;
  std::optional<LocalServer> safety_;
  std::chrono::steady_clock::time_point next_look_;
  std::string told_;  ///< what `look` has told, while it lasts
};

}  // namespace trn
