#include "hal/lcm_link.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace trn {

namespace {

struct Group {
  std::string address;
  int port = 0;
};

// "udpm://ADDRESS:PORT?..." ; an empty address stands for LCM's own default.
Group parse_group(const std::string& url) {
  Group group{"239.255.76.67", 7667};
  const std::string rest = url.substr(std::strlen("udpm://"));
  const std::string host = rest.substr(0, rest.find('?'));
  const auto colon = host.find(':');
  if (!host.substr(0, colon).empty()) group.address = host.substr(0, colon);
  if (colon != std::string::npos) group.port = std::atoi(host.c_str() + colon + 1);
  return group;
}

class Socket {
 public:
  Socket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

constexpr const char* kRemedy =
    "multicast on the loopback device is needed:\n"
    "  ip link set lo up multicast on\n"
    "  ip route add 224.0.0.0/4 dev lo";

std::string failure(const std::string& what) {
  return fmt::format("LCM cannot work on this host: {} ({}); {}", what, std::strerror(errno), kRemedy);
}

// Any port will do for the test: what is in question is the way of the group's datagrams.
std::string bind_and_join(int fd, const Group& group, sockaddr_in& bound) {
  bound = {};
  bound.sin_family = AF_INET;
  bound.sin_addr.s_addr = htonl(INADDR_ANY);
  socklen_t size = sizeof bound;
  auto* address = reinterpret_cast<sockaddr*>(&bound);
  if (bind(fd, address, size) != 0 || getsockname(fd, address, &size) != 0) return failure("no UDP port");
  ip_mreq member{};
  member.imr_interface.s_addr = htonl(INADDR_ANY);
  if (inet_pton(AF_INET, group.address.c_str(), &member.imr_multiaddr) != 1)
    return fmt::format("the LCM url names '{}', which is not an IPv4 address", group.address);
  if (setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &member, sizeof member) != 0)
    return failure("joining " + group.address + " failed");
  bound.sin_addr = member.imr_multiaddr;
  return "";
}

}  // namespace

LcmConfig read_lcm(const ConfigTable& root, const std::string& machine_name) {
  LcmConfig config;
  config.machine = machine_name;
  const auto section = root.table_if("lcm");
  if (section) config.url = section->text("url", LcmConfig::kDefaultUrl);
  if (machine_name.empty() || machine_name.size() > 40 || machine_name.find('/') != std::string::npos)
    throw root.error("machine",
                     "'machine.name' becomes part of channel and file names: 1 to 40 characters, no '/'");
  return config;
}

std::string lcm_self_test(const std::string& url) {
  if (url.rfind("udpm://", 0) != 0) return "";
  const Group group = parse_group(url);
  const Socket socket;
  if (socket.fd() < 0) return failure("no UDP socket");
  sockaddr_in target;
  std::string bad = bind_and_join(socket.fd(), group, target);
  if (!bad.empty()) return bad;
  const unsigned char ttl = 0;
  setsockopt(socket.fd(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  if (sendto(socket.fd(), "trunnion", 8, 0, reinterpret_cast<sockaddr*>(&target), sizeof target) != 8)
    return failure("sending to " + group.address + " failed");
  pollfd waiting{socket.fd(), POLLIN, 0};
  if (poll(&waiting, 1, 500) == 1) return "";
  errno = ETIMEDOUT;
  return failure("a datagram to " + group.address + " did not come back");
}

LcmLink::LcmLink(const std::string& url)
    : lcm_([&] {
        const std::string bad = lcm_self_test(url);
        if (!bad.empty()) throw std::runtime_error(bad);
        return url;
      }()) {
  if (!lcm_.good())
    throw std::runtime_error(
        fmt::format("LCM cannot open '{}'; a legal url is {}", url, LcmConfig::kDefaultUrl));
}

bool LcmLink::handle(int timeout_ms) {
  const int outcome = lcm_.handleTimeout(timeout_ms);
  if (outcome < 0) throw std::runtime_error("LCM stopped receiving; restart this process");
  return outcome > 0;
}

void LcmLink::check(int outcome, const std::string& channel) {
  if (outcome != 0)
    throw std::runtime_error(fmt::format("LCM cannot send on '{}': {}", channel, std::strerror(errno)));
}

}  // namespace trn
