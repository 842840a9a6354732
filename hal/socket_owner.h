#pragma once

#include <sys/types.h>

#include <cstdint>
#include <istream>
#include <optional>

namespace trn {

/// Who owns the UDP sockets of this port, as the kernel's table (/proc/net/udp) says: nothing if it names
/// none, or several owners.
std::optional<uid_t> owner_of_port(std::uint16_t port, std::istream& table);

/// The owner of the socket on this host that sends from `port`; nothing if there is none, or no single one.
std::optional<uid_t> owner_of_port(std::uint16_t port);

}  // namespace trn
