#pragma once

#include <memory>
#include <optional>
#include <string>

#include "panel/server/log_in.h"
#include "panel/server/panel_config.h"

namespace trn {

/// What a request shows of who asks.
struct Credentials {
  std::string authorization, cookie;  ///< headers
};

/// Who may have what of a panel: on the loopback whoever has the key, with TLS whoever has logged in.
class Door {
 public:
  /// UserError where the file of users cannot be used.
  explicit Door(const PanelConfig& config);

  /// Null where the key opens.
  LogIn* log_in() { return log_in_.get(); }
  bool is_key(std::string_view text) const { return config_.key && config_.key->is(text); }
  /// True if the Host header of a request may stand there.
  bool may_be_host(std::string_view host) const;
  /// True if a page of this very panel asks.
  bool is_own_page(std::string_view origin, std::string_view host) const;
  /// Nothing: somebody who may have the page's files only.
  std::optional<Visitor> visitor(const Credentials& shown) const;
  /// "" where none is shown.
  LogIn::SessionId session(const Credentials& shown) const;
  /// Set-Cookie for a session; with an empty token the end of it.
  std::string set_cookie(const std::string& token) const;
  /// For who may not have what he asks for.
  const char* refusal() const;

 private:
  const PanelConfig& config_;
  std::unique_ptr<LogIn> log_in_;
  std::string cookie_;  ///< its name
};

}  // namespace trn
