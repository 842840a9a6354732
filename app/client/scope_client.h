#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/client/access_config.h"
#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"
#include "hal/local_socket.h"

namespace trn {

/// Asks the daemon of a machine of this host for signals of past periods. Not thread-safe.
class ScopeClient {
 public:
  /// NoAnswer if no daemon of this machine answers here within the time.
  ScopeClient(const LcmConfig& names, const AccessConfig& access, double timeout_s);

  /// NoAnswer if none comes within the time.
  trunnion::scope_signals_t signals();
  /// As scope_request_t; as many rows as one message takes. std::runtime_error with the daemon's own word
  /// where it has none of these signals, NoAnswer.
  trunnion::scope_data_t rows(const std::vector<std::string>& signals, std::int64_t from_period);

 private:
  template <typename Message>
  Message ask(trunnion::scope_request_t request, std::optional<Message>& answer);

  LcmConfig names_;
  double timeout_s_;
  std::unique_ptr<LocalClient> link_;
  std::int64_t client_;
  std::int32_t sequence_ = 0;
  std::optional<trunnion::scope_signals_t> list_;
  std::optional<trunnion::scope_data_t> data_;
};

}  // namespace trn
