#include "panel/server/web_rules.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <stdexcept>
#include <utility>

namespace trn {

namespace {

constexpr int kPortMax = 65535;
constexpr std::array<std::string_view, 3> kLoopback{"127.0.0.1", "localhost", "[::1]"};

// The number of a port, or -1. 0 stands for one that is free.
int port_of(std::string_view text) {
  int port = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool sound = error == std::errc{} && end == text.data() + text.size();
  return sound && port >= 0 && port <= kPortMax ? port : -1;
}

bool is_file_letter(char letter) {
  return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
         (letter >= '0' && letter <= '9') || letter == '.' || letter == '_' || letter == '-' || letter == '/';
}

}  // namespace

ListenPlace read_listen_place(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const int port = colon == std::string::npos ? -1 : port_of(std::string_view(text).substr(colon + 1));
  if (port < 0) throw std::runtime_error(fmt::format("'{}' is no ADDRESS:PORT, as 127.0.0.1:8470 is", text));
  const std::string address = text.substr(0, colon);
  in_addr number{};
  if (inet_pton(AF_INET, address.c_str(), &number) != 1)
    throw std::runtime_error(
        fmt::format("'{}' is no address of this computer, as 127.0.0.1 or 192.168.1.20 is", address));
  return {address, port};
}

bool is_loopback(const ListenPlace& place) { return place.address.starts_with("127."); }

bool is_own_host(std::string_view host) {
  return std::any_of(kLoopback.begin(), kLoopback.end(), [&](std::string_view name) {
    if (!host.starts_with(name)) return false;
    const std::string_view rest = host.substr(name.size());
    return rest.empty() || (rest.front() == ':' && port_of(rest.substr(1)) > 0);
  });
}

bool is_own_origin(std::string_view origin, std::string_view scheme, std::string_view host) {
  return !host.empty() && origin == fmt::format("{}://{}", scheme, host);
}

std::string cookie_of(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(';'), header.size());
    std::string_view one = header.substr(0, end);
    header.remove_prefix(std::min(end + 1, header.size()));
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (one.starts_with(name) && one.substr(name.size()).starts_with('='))
      return std::string(one.substr(name.size() + 1));
  }
  return "";
}

std::optional<std::string> page_file(std::string_view path) {
  if (path.empty() || path.front() != '/') return std::nullopt;
  // No part may begin with a dot: neither the folder above nor a hidden file.
  if (path.find("/.") != std::string_view::npos || path.find("//") != std::string_view::npos)
    return std::nullopt;
  if (!std::all_of(path.begin(), path.end(), is_file_letter)) return std::nullopt;
  const std::string file(path.substr(1));
  return file.empty() || file.back() == '/' ? file + "index.html" : file;
}

std::string_view media_type(std::string_view file) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kTypes{
      {{".html", "text/html; charset=utf-8"},
       {".js", "text/javascript; charset=utf-8"},
       {".css", "text/css; charset=utf-8"},
       {".json", "application/json"},
       {".svg", "image/svg+xml"},
       {".png", "image/png"},
       {".woff2", "font/woff2"},
       {".ico", "image/x-icon"}}};
  for (const auto& [ending, type] : kTypes)
    if (file.ends_with(ending)) return type;
  return "application/octet-stream";
}

}  // namespace trn
