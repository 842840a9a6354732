#include "panel/server/panel_server.h"

#include <fmt/format.h>
#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "app/client/command_rights.h"
#include "panel/server/controls.h"
#include "panel/server/door.h"
#include "panel/server/log_in.h"
#include "panel/server/page_folder.h"
#include "panel/server/page_message.h"
#include "panel/server/panel_state.h"
#include "panel/server/program_folder.h"

namespace trn {

namespace {

constexpr std::string_view kApi = "/api/v1/", kStream = "/api/v1/stream", kMetrics = "/metrics",
                           kPrograms = "/api/v1/programs/", kSession = "/api/v1/session",
                           kLogIn = "/api/v1/log_in", kLogOut = "/api/v1/log_out";
constexpr const char* kPlain = "text/plain";
constexpr lws_usec_t kStepUs = 10000;
constexpr std::size_t kChunk = 16384, kHeadersMax = 2048;
constexpr std::size_t kStrangersMax = 16;  // sockets whose page has not said its key yet
constexpr std::chrono::seconds kKeyTime{5};
constexpr std::size_t kUploadMax = 64U << 20, kLogInMax = 4096, kPeerMax = 64;
constexpr unsigned kContinue = 100, kDone = 200, kBadRequest = 400, kNoVisitor = 401, kForbidden = 403,
                   kNotFound = 404, kOnlyGet = 405, kConflict = 409, kTooLong = 413, kTooOften = 429,
                   kBusy = 503;
// RFC 6455, 7.4.2: from 4000 on they are the application's.
constexpr int kCloseNoVisitor = 4401, kCloseTooLate = 4408, kCloseBusy = 4503;
constexpr std::string_view kMapped = "::ffff:";  // before an address of IPv4 (RFC 4291, 2.5.5.2)
constexpr std::string_view kTooLateText = "The page said its key too late: try again.";
constexpr std::string_view kOverText = "This session is over: log in again.";
constexpr std::string_view kQueryText =
    "No request has a query here, and no key belongs in one, where logs keep it: it stands behind the '#'.\n";
constexpr const char* kPolicy = "default-src 'self'; frame-ancestors 'none'";

using Clock = std::chrono::steady_clock;

struct Response {
  unsigned code = kDone;
  std::string type, body;
  std::optional<OpenFile> file;  ///< instead of the body
  std::string cookie;            ///< to be set; "": none
  std::uint64_t sent = 0;

  std::uint64_t size() const { return file ? file->size() : body.size(); }
};

/// A program, or a log-in, on its way from a page.
struct Upload {
  std::string path, text;
  std::size_t bytes_max = 0;
};

struct Socket {
  PageId page = 0;           ///< 0: it has not said its key yet
  LogIn::SessionId session;  ///< where pages log in
  Visitor visitor;
  std::string received;
  Clock::time_point opened = Clock::now();
};

/// The sockets of the panel: hands what comes to the state, and takes from it what is to go.
class PanelServer {
 public:
  explicit PanelServer(const PanelConfig& config)
      : config_(config), files_(config.page_folder), door_(config), state_(config) {}
  void run(const std::atomic<bool>& stop);
  int happened(lws* wsi, lws_callback_reasons reason, std::string_view in);
  void step();

 private:
  Response answer(lws* wsi, std::string_view path);
  Response answer_visitor(lws* wsi, std::string_view path) const;
  Response answer_session(lws* wsi) const;
  Response log_out(lws* wsi);
  void begin_log_in(lws* wsi, const Upload& upload);
  void end_log_ins();
  Response no_visitor() const { return {kNoVisitor, kPlain, std::string(door_.refusal()) + "\n", {}, {}}; }
  Response begin_upload(lws* wsi, std::string_view path);
  Response refuse_upload(lws* wsi, std::string_view path) const;
  Response keep(const Upload& upload);
  int take_upload(lws* wsi, std::string_view piece);
  int end_upload(lws* wsi);
  int begin_response(lws* wsi, std::string_view path);
  int send(lws* wsi, Response response);
  int go_on_response(lws* wsi);
  int write_page(lws* wsi);
  unsigned refuse_stream(lws* wsi) const;
  int receive(lws* wsi, std::string_view in);
  int let_in(lws* wsi, Socket& socket, std::string_view text);
  int open_page(lws* wsi, Socket& socket);
  void establish(lws* wsi);
  bool is_over(const Socket& socket);
  std::size_t strangers() const;

  const PanelConfig& config_;
  PageFolder files_;
  Door door_;
  PanelState state_;
  std::map<lws*, Response> responses_;
  std::map<lws*, Upload> uploads_;
  std::map<std::uint64_t, lws*> log_ins_;  ///< requests whose password is being compared
  std::uint64_t last_ticket_ = 0;
  std::map<lws*, Socket> sockets_;
  PageId last_page_ = 0;
  std::vector<unsigned char> piece_ = std::vector<unsigned char>(LWS_PRE + kChunk);  ///< of a response
};

// The library's timer hands back its own address only, which is the first member of this.
struct Timer {
  lws_sorted_usec_list_t list{};
  lws_context* context = nullptr;
  PanelServer* server = nullptr;
};

std::string header(lws* wsi, lws_token_indexes name) {
  const int size = lws_hdr_total_length(wsi, name);
  if (size <= 0) return "";
  std::string text(static_cast<std::size_t>(size) + 1, '\0');
  if (lws_hdr_copy(wsi, text.data(), size + 1, name) < 0) return "";
  text.resize(static_cast<std::size_t>(size));
  return text;
}

// Says why, where the page can show it, and ends the connection.
int close_stream(lws* wsi, int code, std::string_view why) {
  std::string text(why);
  lws_close_reason(wsi, static_cast<lws_close_status>(code), reinterpret_cast<unsigned char*>(text.data()),
                   text.size());
  return -1;
}

bool has_query(lws* wsi) { return lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_URI_ARGS) > 0; }

Credentials credentials(lws* wsi) {
  return {header(wsi, WSI_TOKEN_HTTP_AUTHORIZATION), header(wsi, WSI_TOKEN_HTTP_COOKIE)};
}

Response plain(unsigned code, std::string_view text) { return {code, kPlain, std::string(text), {}, {}}; }

Response PanelServer::answer(lws* wsi, std::string_view path) {
  if (!door_.may_be_host(header(wsi, WSI_TOKEN_HOST)))
    return plain(kForbidden, "This panel answers as localhost or 127.0.0.1 only.\n");
  if (has_query(wsi)) return plain(kBadRequest, kQueryText);
  if (path == kSession) return answer_session(wsi);
  if (path.starts_with(kApi) || path == kMetrics) return answer_visitor(wsi, path);
  const std::optional<std::string> name = page_file(path);
  std::optional<OpenFile> file = name ? files_.open(*name) : std::nullopt;
  if (file) return {kDone, std::string(media_type(*name)), "", std::move(file), {}};
  return plain(kNotFound, "There is no such thing here.\n");
}

// Tells a page whether it is to log in, which it cannot see of its cookie.
Response PanelServer::answer_session(lws* wsi) const {
  const std::optional<Visitor> visitor = door_.visitor(credentials(wsi));
  const bool named = visitor && config_.tls;
  const nlohmann::json body{{"log_in", config_.tls.has_value()},
                            {"name", named ? visitor->name : ""},
                            {"role", named ? std::string(to_string(visitor->role)) : ""}};
  return {kDone, "application/json", body.dump(), {}, {}};
}

Response PanelServer::answer_visitor(lws* wsi, std::string_view path) const {
  if (!door_.visitor(credentials(wsi))) return no_visitor();
  if (path == kMetrics) return {kDone, "text/plain; version=0.0.4; charset=utf-8", state_.metrics(), {}, {}};
  const std::string_view name = path.substr(kApi.size());
  std::optional<OpenFile> plan = name == "plan" ? state_.plan() : std::nullopt;
  if (!plan) plan = state_.drawing(name);
  if (plan) return {kDone, "application/octet-stream", "", std::move(plan), {}};
  std::optional<OpenFile> text = state_.program_text(name);
  if (text) return {kDone, "text/plain; charset=utf-8", "", std::move(text), {}};
  std::optional<std::string> body = state_.get(name);
  if (body) return {kDone, "application/json", std::move(*body), {}, {}};
  return plain(kNotFound, "There is no such thing here.\n");
}

Response PanelServer::log_out(lws* wsi) {
  if (!door_.is_own_page(header(wsi, WSI_TOKEN_ORIGIN), header(wsi, WSI_TOKEN_HOST)))
    return plain(kForbidden, "Only this panel's own page logs out.\n");
  if (!door_.log_in()) return plain(kNotFound, "Nobody logs in to this panel: its key opens it.\n");
  door_.log_in()->end(door_.session(credentials(wsi)));
  Response response = plain(kDone, "Logged out.\n");
  response.cookie = door_.set_cookie("");
  return response;
}

// Why nothing may come; kContinue: it may.
Response PanelServer::refuse_upload(lws* wsi, std::string_view path) const {
  if (!door_.is_own_page(header(wsi, WSI_TOKEN_ORIGIN), header(wsi, WSI_TOKEN_HOST)))
    return plain(kForbidden, "What is sent here comes from this panel's own page.\n");
  if (has_query(wsi)) return plain(kBadRequest, kQueryText);
  if (path == kLogIn)
    return config_.tls ? plain(kContinue, "") : plain(kNotFound, "Nobody logs in to this panel.\n");
  const std::optional<Visitor> visitor = door_.visitor(credentials(wsi));
  if (!visitor) return no_visitor();
  if (visitor->role < Role::kOperate) return plain(kForbidden, "Your role is to look, not to operate.\n");
  if (!path.starts_with(kPrograms)) return plain(kNotFound, "There is no such thing here.\n");
  const bool another = std::any_of(uploads_.begin(), uploads_.end(),
                                   [](const auto& one) { return one.second.path != kLogIn; });
  return another ? plain(kBusy, "Another program is on its way; send this one again.\n")
                 : plain(kContinue, "");
}

Response PanelServer::begin_upload(lws* wsi, std::string_view path) {
  Response refused = refuse_upload(wsi, path);
  if (refused.code != kContinue) return refused;
  const std::string size = header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH);
  std::size_t bytes = 0;
  const auto [end, error] = std::from_chars(size.data(), size.data() + size.size(), bytes);
  if (error != std::errc{} || end != size.data() + size.size())
    return plain(kBadRequest, "The request must tell its length.\n");
  const std::size_t most = path == kLogIn ? kLogInMax : kUploadMax;
  if (bytes > most)
    return plain(kTooLong, path == kLogIn ? "A log-in is shorter.\n" : "A program may have 64 MB here.\n");
  uploads_[wsi] = {std::string(path), "", most};
  return plain(kContinue, "");
}

int PanelServer::take_upload(lws* wsi, std::string_view piece) {
  const auto found = uploads_.find(wsi);
  if (found == uploads_.end()) return 0;  // of a request that was refused
  found->second.text += piece;
  return found->second.text.size() > found->second.bytes_max ? -1 : 0;
}

int PanelServer::end_upload(lws* wsi) {
  const auto found = uploads_.find(wsi);
  if (found == uploads_.end()) return 0;
  const Upload upload = std::move(found->second);
  uploads_.erase(found);
  if (upload.path != kLogIn) return send(wsi, keep(upload));
  begin_log_in(wsi, upload);
  return 0;
}

Response PanelServer::keep(const Upload& upload) {
  try {
    state_.keep(upload.path.substr(kPrograms.size()), upload.text);
    return plain(kDone, "Kept.\n");
  } catch (const NoProgram& none) {
    return plain(kConflict, std::string(none.what()) + "\n");
  }
}

void PanelServer::begin_log_in(lws* wsi, const Upload& upload) {
  std::array<char, kPeerMax> peer{};
  lws_get_peer_simple(wsi, peer.data(), peer.size());
  const std::optional<LogInMessage> said = read_log_in(upload.text);
  if (!said) {
    send(wsi, plain(kBadRequest, "A log-in has 'name' and 'password'.\n"));
    return;
  }
  const std::uint64_t ticket = ++last_ticket_;
  std::string address = peer.data();
  if (address.starts_with(kMapped)) address.erase(0, kMapped.size());
  switch (door_.log_in()->begin(ticket, said->name, said->password, address)) {
    case LogIn::Begun::kWorks:
      log_ins_[ticket] = wsi;
      break;
    case LogIn::Begun::kTooOften:
      send(wsi, plain(kTooOften, "Too many log-ins failed; wait some minutes.\n"));
      break;
    case LogIn::Begun::kBusy:
      send(wsi, plain(kBusy, "Many log in just now; try again.\n"));
      break;
  }
}

void PanelServer::end_log_ins() {
  for (const LogIn::Result& result : door_.log_in()->take_results()) {
    const auto found = log_ins_.find(result.ticket);
    if (found == log_ins_.end()) continue;  // who asked has gone
    lws* wsi = found->second;
    log_ins_.erase(found);
    Response response = result.token.empty() ? plain(kNoVisitor, "Name or password is wrong.\n")
                                             : plain(kDone, "Logged in.\n");
    if (!result.token.empty()) response.cookie = door_.set_cookie(result.token);
    send(wsi, std::move(response));
  }
}

int PanelServer::begin_response(lws* wsi, std::string_view path) {
  if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) > 0) return send(wsi, answer(wsi, path));
  if (lws_hdr_total_length(wsi, WSI_TOKEN_POST_URI) == 0)
    return send(wsi, plain(kOnlyGet, "Only GET and POST are answered here.\n"));
  if (path == kLogOut) return send(wsi, log_out(wsi));
  Response response = begin_upload(wsi, path);
  return response.code == kContinue ? 0 : send(wsi, std::move(response));
}

int PanelServer::send(lws* wsi, Response response) {
  std::array<unsigned char, LWS_PRE + kHeadersMax> buffer{};
  unsigned char *begin = buffer.data() + LWS_PRE, *at = begin, *end = buffer.data() + buffer.size();
  const auto add = [&](const char* name, std::string_view value) {
    return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                       reinterpret_cast<const unsigned char*>(value.data()),
                                       static_cast<int>(value.size()), &at, end) != 0;
  };
  const lws_filepos_t size = response.size();
  if (lws_add_http_common_headers(wsi, response.code, response.type.c_str(), size, &at, end) ||
      add("content-security-policy:", kPolicy) || add("x-content-type-options:", "nosniff") ||
      (response.code == kNoVisitor && add("www-authenticate:", "Bearer")) ||
      (!response.cookie.empty() && add("set-cookie:", response.cookie)) ||
      add("referrer-policy:", "no-referrer") || add("cache-control:", "no-cache") ||
      lws_finalize_write_http_header(wsi, begin, &at, end))
    return 1;
  responses_[wsi] = std::move(response);
  lws_callback_on_writable(wsi);
  return 0;
}

int PanelServer::go_on_response(lws* wsi) {
  const auto found = responses_.find(wsi);
  if (found == responses_.end()) return 0;
  Response& response = found->second;
  const std::size_t size = std::min<std::uint64_t>(kChunk, response.size() - response.sent);
  const bool last = response.sent + size == response.size();
  const std::span<unsigned char> piece = std::span(piece_).subspan(LWS_PRE, size);
  if (!response.file)
    std::memcpy(piece.data(), response.body.data() + response.sent, size);
  else if (!response.file->read(response.sent, piece))
    return -1;  // it has become shorter than was said
  if (lws_write(wsi, piece.data(), size, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0) return -1;
  response.sent += size;
  if (!last) {
    lws_callback_on_writable(wsi);
    return 0;
  }
  responses_.erase(found);
  return lws_http_transaction_completed(wsi) ? -1 : 0;
}

int PanelServer::write_page(lws* wsi) {
  const auto found = sockets_.find(wsi);
  if (found == sockets_.end()) return -1;
  const PageId page = found->second.page;
  if (is_over(found->second)) {
    // A browser on a busy computer may be this slow: its key is not wrong, so it may come again by itself.
    if (page == 0 && !door_.log_in()) return close_stream(wsi, kCloseTooLate, kTooLateText);
    return close_stream(wsi, kCloseNoVisitor, page == 0 ? door_.refusal() : kOverText);
  }
  if (page == 0) return 0;
  if (state_.overflown(page)) return -1;
  const std::optional<std::string> text = state_.next(page);
  if (!text) return 0;
  std::vector<unsigned char> buffer(LWS_PRE + text->size());
  std::memcpy(buffer.data() + LWS_PRE, text->data(), text->size());
  if (lws_write(wsi, buffer.data() + LWS_PRE, text->size(), LWS_WRITE_TEXT) < 0) return -1;
  if (state_.waiting(page)) lws_callback_on_writable(wsi);
  return 0;
}

int PanelServer::receive(lws* wsi, std::string_view in) {
  const auto found = sockets_.find(wsi);
  if (found == sockets_.end() || found->second.received.size() + in.size() > kPageMessageMax) return -1;
  found->second.received += in;
  if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi) > 0) return 0;
  const std::string text = std::exchange(found->second.received, {});
  if (found->second.page == 0) return let_in(wsi, found->second, text);
  return state_.receive(found->second.page, text) ? 0 : -1;
}

// The first message of a page is its key: a browser cannot give a WebSocket's request a header.
int PanelServer::let_in(lws* wsi, Socket& socket, std::string_view text) {
  PageMessage message;
  try {
    message = read_page_message(text);
  } catch (const BadPageMessage&) {
    message = {};
  }
  if (door_.log_in() || message.kind != PageMessage::Kind::kKey || !door_.is_key(message.key))
    return close_stream(wsi, kCloseNoVisitor, door_.refusal());
  socket.visitor.role = Role::kSetUp;
  return open_page(wsi, socket);
}

int PanelServer::open_page(lws* wsi, Socket& socket) {
  const PageId page = last_page_ + 1;
  if (!state_.open(page, socket.visitor)) return close_stream(wsi, kCloseBusy, "Too many pages are open.");
  socket.page = last_page_ = page;
  lws_callback_on_writable(wsi);
  return 0;
}

// Where pages log in, the request of the stream has the cookie that says who opens it.
void PanelServer::establish(lws* wsi) {
  Socket& socket = sockets_[wsi] = {};
  if (!door_.log_in()) return;
  const Credentials shown = credentials(wsi);
  socket.session = door_.session(shown);
  const std::optional<Visitor> visitor = door_.log_in()->visitor(socket.session);
  if (!visitor) {
    socket.opened -= kKeyTime;
    lws_callback_on_writable(wsi);
    return;
  }
  socket.visitor = *visitor;
  open_page(wsi, socket);
}

// It waited too long for its key, or its session has ended or changed.
bool PanelServer::is_over(const Socket& socket) {
  if (socket.page == 0) return Clock::now() - socket.opened >= kKeyTime;
  return door_.log_in() && door_.log_in()->visitor(socket.session) != socket.visitor;
}

std::size_t PanelServer::strangers() const {
  return static_cast<std::size_t>(
      std::count_if(sockets_.begin(), sockets_.end(), [](const auto& one) { return one.second.page == 0; }));
}

// 0: the stream may begin; otherwise the code of the answer.
unsigned PanelServer::refuse_stream(lws* wsi) const {
  if (!door_.is_own_page(header(wsi, WSI_TOKEN_ORIGIN), header(wsi, WSI_TOKEN_HOST))) return kForbidden;
  if (has_query(wsi)) return kBadRequest;
  if (header(wsi, WSI_TOKEN_GET_URI) != kStream) return kNotFound;
  return strangers() >= kStrangersMax ? kBusy : 0;
}

int PanelServer::happened(lws* wsi, lws_callback_reasons reason, std::string_view in) {
  switch (reason) {
    case LWS_CALLBACK_HTTP:
      return begin_response(wsi, in);
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return go_on_response(wsi);
    case LWS_CALLBACK_HTTP_BODY:
      return take_upload(wsi, in);
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      return end_upload(wsi);
    case LWS_CALLBACK_CLOSED_HTTP:
      responses_.erase(wsi);
      uploads_.erase(wsi);
      std::erase_if(log_ins_, [wsi](const auto& one) { return one.second == wsi; });
      return 0;
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: {
      const unsigned refused = refuse_stream(wsi);
      if (refused == 0) return 0;
      lws_return_http_status(wsi, refused, nullptr);
      return 1;
    }
    case LWS_CALLBACK_ESTABLISHED:
      establish(wsi);
      return 0;
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return write_page(wsi);
    case LWS_CALLBACK_RECEIVE:
      return receive(wsi, in);
    case LWS_CALLBACK_CLOSED:
      if (const auto found = sockets_.find(wsi); found != sockets_.end()) state_.close(found->second.page);
      sockets_.erase(wsi);
      return 0;
    default:
      return 0;
  }
}

void PanelServer::step() {
  state_.step();
  if (door_.log_in()) {
    door_.log_in()->step();
    end_log_ins();
  }
  for (const auto& [wsi, socket] : sockets_)
    if (is_over(socket) || state_.overflown(socket.page) || state_.waiting(socket.page))
      lws_callback_on_writable(wsi);
}

// No exception may pass through the library, which is C: the connection ends instead.
int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
  auto* server = static_cast<PanelServer*>(lws_context_user(lws_get_context(wsi)));
  if (!server) return 0;
  try {
    // Other reasons pass other things than text.
    const bool text = in && (reason == LWS_CALLBACK_HTTP || reason == LWS_CALLBACK_HTTP_BODY ||
                             reason == LWS_CALLBACK_RECEIVE);
    return server->happened(wsi, reason, text ? std::string_view(static_cast<char*>(in), size) : "");
  } catch (const std::exception& error) {
    fmt::print(stderr, "panel: {}\n", error.what());
    return -1;
  }
}

void on_timer(lws_sorted_usec_list_t* list) {
  auto* timer = reinterpret_cast<Timer*>(list);
  try {
    timer->server->step();
  } catch (const std::exception& error) {
    fmt::print(stderr, "panel: {}\n", error.what());
  }
  lws_sul_schedule(timer->context, 0, list, on_timer, kStepUs);
}

void PanelServer::run(const std::atomic<bool>& stop) {
  lws_set_log_level(LLL_ERR, nullptr);
  std::array<lws_protocols, 3> protocols{};
  protocols[0].name = "http";
  protocols[0].callback = callback;
  protocols[1].name = "trunnion-1";
  protocols[1].callback = callback;
  protocols[1].rx_buffer_size = kPageMessageMax;
  lws_context_creation_info info{};
  info.port = config_.listen.port;
  info.iface = config_.listen.address.c_str();
  info.protocols = protocols.data();
  info.user = this;
  info.gid = info.uid = -1;
  info.options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
  if (config_.tls) {
    info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
    info.alpn = "http/1.1";  // a stream has its own line
    info.ssl_cert_filepath = config_.tls->certificate_file.c_str();
    info.ssl_private_key_filepath = config_.tls->key_file.c_str();
  }
  const std::unique_ptr<lws_context, decltype(&lws_context_destroy)> context(lws_create_context(&info),
                                                                             lws_context_destroy);
  if (!context)
    throw std::runtime_error(fmt::format(
        "cannot listen on {}:{}; is another panel running{}?", config_.listen.address, config_.listen.port,
        config_.tls ? ", or is this no certificate with its own private key" : ""));
  // Behind the '#' the key is in no request, so in no log and no Referer.
  const bool told = config_.print_key && config_.key;
  fmt::print("Panel of '{}': {}://{}:{}/{}{}\n", config_.machine.name, config_.tls ? "https" : "http",
             config_.listen.address,
             lws_get_vhost_listen_port(lws_get_vhost_by_name(context.get(), "default")), told ? "#key=" : "",
             told ? config_.key->text() : "");
  std::fflush(stdout);
  Timer timer;
  timer.context = context.get();
  timer.server = this;
  lws_sul_schedule(context.get(), 0, &timer.list, on_timer, kStepUs);
  while (!stop && lws_service(context.get(), 0) >= 0) {
  }
}

}  // namespace

void serve_panel(const PanelConfig& config, const std::atomic<bool>& stop) { PanelServer(config).run(stop); }

}  // namespace trn
