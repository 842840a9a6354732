#include "hal/udp_group.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/filter.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <stdexcept>

#include "hal/wire_layout.h"

namespace trn {

namespace {

constexpr const char* kScheme = "udpm://";
constexpr const char* kLegal = "a legal url is udpm://239.255.76.67:7667?ttl=0";
constexpr int kReceiveBufferBytes = 8 << 20;  // some thousand datagrams: a flood leaves room for a stop
constexpr int kForeignMax = 64;               // datagrams of others that one call throws away

std::runtime_error failure(const std::string& what) {
  return std::runtime_error(fmt::format(
      "LCM cannot work on this host: {} ({}); the loopback device must be up:\n  ip link set lo up", what,
      std::strerror(errno)));
}

int open_socket() {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) throw failure("no UDP socket");
  return fd;
}

template <typename Value>
bool set(int fd, int level, int option, const Value& value) {
  return setsockopt(fd, level, option, &value, sizeof value) == 0;
}

int number_in(std::string_view text, int min, int max, const std::string& url) {
  int value = -1;
  const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc{} || rest != text.data() + text.size() || value < min || value > max)
    throw std::runtime_error(fmt::format("the LCM url '{}' has '{}' where a number from {} to {} belongs; {}",
                                         url, text, min, max, kLegal));
  return value;
}

ip_mreqn membership(in_addr group, int device) {
  ip_mreqn member{};
  member.imr_multiaddr = group;
  member.imr_ifindex = device;
  return member;
}

int loopback_of(const UdpAddress& address) {
  return address.stays_here() ? static_cast<int>(if_nametoindex("lo")) : 0;
}

// A socket that sends has a port, and what anybody sends there would wait to be read: the kernel drops it.
bool hear_nothing(int fd) {
  sock_filter drop_all = BPF_STMT(BPF_RET | BPF_K, 0);
  const sock_fprog program{1, &drop_all};
  return set(fd, SOL_SOCKET, SO_ATTACH_FILTER, program);
}

}  // namespace

UdpAddress UdpAddress::parse(const std::string& url) {
  if (url.rfind(kScheme, 0) != 0)
    throw std::runtime_error(fmt::format("the LCM url '{}' is not understood; {}", url, kLegal));
  std::string_view rest = std::string_view(url).substr(std::strlen(kScheme));
  const std::size_t question = rest.find('?');
  const std::string_view host = rest.substr(0, question);
  const std::size_t colon = host.find(':');
  UdpAddress out;
  const std::string group(host.substr(0, colon).empty() ? "239.255.76.67" : host.substr(0, colon));
  if (inet_pton(AF_INET, group.c_str(), &out.group) != 1 || !IN_MULTICAST(ntohl(out.group.s_addr)))
    throw std::runtime_error(
        fmt::format("the LCM url names '{}', which is not an IPv4 multicast address; {}", group, kLegal));
  // LCM's own defaults for group and port.
  out.port = 7667;
  if (colon != std::string_view::npos)
    out.port = static_cast<std::uint16_t>(number_in(host.substr(colon + 1), 1, 65535, url));
  rest = question == std::string_view::npos ? std::string_view() : rest.substr(question + 1);
  if (rest.starts_with("ttl="))
    out.ttl = number_in(rest.substr(4), 0, 255, url);
  else if (!rest.empty())
    throw std::runtime_error(fmt::format("the LCM url '{}' has an option besides ttl; {}", url, kLegal));
  return out;
}

std::string UdpAddress::text() const {
  char out[INET_ADDRSTRLEN] = {};
  return inet_ntop(AF_INET, &group, out, sizeof out);
}

UdpReceiver::UdpReceiver(const UdpAddress& address)
    : fd_(open_socket()), loopback_(loopback_of(address)), group_(address.group), buffer_(kDatagramBytesMax) {
  try {
    join(address);
  } catch (...) {
    close(fd_);
    throw;
  }
}

UdpReceiver::~UdpReceiver() { close(fd_); }

void UdpReceiver::join(const UdpAddress& address) {
  set(fd_, SOL_SOCKET, SO_REUSEADDR, 1);  // every process of the group binds the same port
  set(fd_, SOL_SOCKET, SO_REUSEPORT, 1);
  // The forced size passes the system's limit and needs CAP_NET_ADMIN; without it the buffer is as large as
  // the limit allows.
  if (!set(fd_, SOL_SOCKET, SO_RCVBUFFORCE, kReceiveBufferBytes))
    set(fd_, SOL_SOCKET, SO_RCVBUF, kReceiveBufferBytes);
  sockaddr_in bound{};
  bound.sin_family = AF_INET;
  bound.sin_port = htons(address.port);
  // Bound to the group and not to any address: datagrams to the port alone, from anybody who knows it, do not
  // come in.
  bound.sin_addr = address.group;
  if (bind(fd_, reinterpret_cast<sockaddr*>(&bound), sizeof bound) != 0)
    throw failure(fmt::format("port {} cannot be bound", address.port));
  if (address.stays_here() && loopback_ == 0) throw failure("there is no loopback device");
  if (!set(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership(group_, loopback_)))
    throw failure("joining " + address.text() + " failed");
  // what other programs have joined on other devices does not come here
  if (!set(fd_, IPPROTO_IP, IP_MULTICAST_ALL, 0) || !set(fd_, IPPROTO_IP, IP_PKTINFO, 1))
    throw failure("the socket cannot be kept to its group");
}

bool UdpReceiver::is_ours(msghdr& message) const {
  // Cut off data is no message, and cut off control data would not tell where it came from.
  if (message.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) return false;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != IPPROTO_IP || c->cmsg_type != IP_PKTINFO) continue;
    in_pktinfo info;
    std::memcpy(&info, CMSG_DATA(c), sizeof info);
    // With ttl=0 nothing may leave or enter this host, so the datagram must have come over the loopback
    // device.
    return info.ipi_addr.s_addr == group_.s_addr && (loopback_ == 0 || info.ipi_ifindex == loopback_);
  }
  return false;
}

bool UdpReceiver::receive(std::span<const std::uint8_t>& datagram, WireSender& sender) {
  // Bounded: a flood of foreign datagrams must not keep the caller here.
  for (int foreign = 0; foreign < kForeignMax; ++foreign) {
    sockaddr_in from{};
    iovec place{buffer_.data(), buffer_.size()};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(in_pktinfo))];
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof from;
    message.msg_iov = &place;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    const ssize_t size = recvmsg(fd_, &message, 0);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return false;
    if (!is_ours(message)) continue;
    datagram = std::span(buffer_).first(static_cast<std::size_t>(size));
    sender = {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
    return true;
  }
  return false;
}

bool UdpReceiver::wait(int timeout_ms) const {
  pollfd waiting{fd_, POLLIN, 0};
  return poll(&waiting, 1, timeout_ms) == 1;
}

std::uint16_t UdpReceiver::port() const {
  sockaddr_in bound{};
  socklen_t size = sizeof bound;
  getsockname(fd_, reinterpret_cast<sockaddr*>(&bound), &size);
  return ntohs(bound.sin_port);
}

UdpSender::UdpSender(const UdpAddress& address) : fd_(open_socket()), group_(address.group) {
  // Sent over the loopback device whatever the routes say: a route for multicast that leads to the shop's
  // network must not carry the machine's state there.
  const bool kept = !address.stays_here() ||
                    set(fd_, IPPROTO_IP, IP_MULTICAST_IF, membership(in_addr{}, loopback_of(address)));
  // A subscriber of LCM's own joins on the device of the default route. What is sent over another device
  // still reaches it, if anybody has joined there: this socket does, and hears nothing.
  if (address.stays_here()) set(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership(group_, loopback_of(address)));
  if (kept && hear_nothing(fd_) && set(fd_, IPPROTO_IP, IP_MULTICAST_TTL, address.ttl) &&
      set(fd_, IPPROTO_IP, IP_MULTICAST_LOOP, 1))
    return;
  const std::runtime_error error = failure("a socket cannot be made to send to " + address.text());
  close(fd_);
  throw error;
}

UdpSender::~UdpSender() { close(fd_); }

bool UdpSender::send(std::span<const std::uint8_t> datagram, std::uint16_t port) const {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  to.sin_addr = group_;
  ssize_t sent = -1;
  do sent = sendto(fd_, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
  while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(datagram.size());
}

}  // namespace trn
