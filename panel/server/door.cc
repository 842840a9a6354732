#include "panel/server/door.h"

#include <fmt/format.h>

#include <cctype>
#include <string_view>

#include "app/client/command_rights.h"
#include "panel/server/web_rules.h"

namespace trn {

namespace {

constexpr std::string_view kBearer = "Bearer ";

// A computer's panels share their cookies, whatever the port. The prefix keeps other hosts of a domain from
// setting one (RFC 6265bis, 4.1.3.2).
std::string cookie_name(std::string machine) {
  for (char& letter : machine)
    if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
  return "__Host-trunnion-" + machine;
}

}  // namespace

Door::Door(const PanelConfig& config) : config_(config), cookie_(cookie_name(config.machine.name)) {
  if (config.tls) log_in_ = std::make_unique<LogIn>(config.tls->users_file, config.tls->session_life);
}

bool Door::may_be_host(std::string_view host) const {
  // The certificate tells a browser whether it is at the right host.
  return config_.tls ? !host.empty() : is_own_host(host);
}

bool Door::is_own_page(std::string_view origin, std::string_view host) const {
  return may_be_host(host) && is_own_origin(origin, config_.tls ? "https" : "http", host);
}

std::optional<Visitor> Door::visitor(const Credentials& shown) const {
  const std::string_view said = shown.authorization;
  if (said.starts_with(kBearer) && is_key(said.substr(kBearer.size())))
    return Visitor{"", log_in_ ? Role::kLook : Role::kSetUp};
  return log_in_ ? log_in_->visitor(session(shown)) : std::nullopt;
}

LogIn::SessionId Door::session(const Credentials& shown) const {
  const std::string token = cookie_of(shown.cookie, cookie_);
  return token.empty() ? "" : LogIn::id_of(token);
}

std::string Door::set_cookie(const std::string& token) const {
  const auto life = token.empty() ? std::chrono::seconds(0) : config_.tls->session_life;
  return fmt::format("{}={}; Path=/; Max-Age={}; HttpOnly; Secure; SameSite=Strict", cookie_, token,
                     life.count());
}

const char* Door::refusal() const {
  return log_in_
             ? "Log in first."
             : "This page has no key, or not this panel's: open the address that 'trunnion panel' printed.";
}

}  // namespace trn
