#pragma once

#include <optional>
#include <string>
#include <string_view>

// What a request must be before the panel looks at it.
namespace trn {

/// The place where the panel listens.
struct ListenPlace {
  std::string address;
  int port = 0;
};
/// Of "127.0.0.1:8470"; std::runtime_error with the reason where it is no such text. Port 0: one that is
/// free.
ListenPlace read_listen_place(const std::string& text);
/// True if others than this host cannot reach the place.
bool is_loopback(const ListenPlace& place);

/// True if a Host header names this host's loopback, with or without a port: another name may be somebody
/// else's that was made to lead here (DNS rebinding).
bool is_own_host(std::string_view host);
/// True if a page that this very server sent asks: `origin` is `scheme` ("http", "https") and `host`.
bool is_own_origin(std::string_view origin, std::string_view scheme, std::string_view host);
/// The value of this cookie in a Cookie header; "" where it is not in it.
std::string cookie_of(std::string_view header, std::string_view name);

/// The file below the page's folder that a URL's path names ("/" is index.html); nothing where the path could
/// lead out of the folder.
std::optional<std::string> page_file(std::string_view path);
/// Of the file's ending, for Content-Type.
std::string_view media_type(std::string_view file);

}  // namespace trn
