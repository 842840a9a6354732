#include "hal/socket_owner.h"

#include <fstream>
#include <sstream>
#include <string>

namespace trn {

// A row: "sl: ADDRESS:PORT REMOTE st tx:rx tr:when retrnsmt uid ...", with the port in hexadecimal.
std::optional<uid_t> owner_of_port(std::uint16_t port, std::istream& table) {
  std::optional<uid_t> owner;
  std::string row;
  std::getline(table, row);  // the head
  while (std::getline(table, row)) {
    std::istringstream words(row);
    std::string slot, local, skipped;
    uid_t uid = 0;
    if (!(words >> slot >> local >> skipped >> skipped >> skipped >> skipped >> skipped >> uid)) continue;
    const std::size_t colon = local.rfind(':');
    if (colon == std::string::npos || std::strtoul(local.c_str() + colon + 1, nullptr, 16) != port) continue;
    // Two users on the same port: nobody can say which of them has sent the datagram.
    if (owner && *owner != uid) return std::nullopt;
    owner = uid;
  }
  return owner;
}

std::optional<uid_t> owner_of_port(std::uint16_t port) {
  std::ifstream four("/proc/net/udp"), six("/proc/net/udp6");
  const std::optional<uid_t> a = owner_of_port(port, four), b = owner_of_port(port, six);
  if (a && b && *a != *b) return std::nullopt;
  return a ? a : b;
}

}  // namespace trn
