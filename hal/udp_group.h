#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace trn {

/// A multicast group as an LCM url names it: "udpm://ADDRESS:PORT?ttl=N".
struct UdpAddress {
  in_addr group{};
  std::uint16_t port = 0;
  int ttl = 0;  ///< 0: this host only, over its loopback device, whatever its routes say

  /// std::runtime_error with what would be right.
  static UdpAddress parse(const std::string& url);
  bool stays_here() const { return ttl == 0; }
  std::string text() const;  ///< of the group
};

/// Who sent a datagram. On a group that stays on this host the port belongs to one socket of this host.
struct WireSender {
  std::uint32_t address = 0;  ///< IPv4, host order
  std::uint16_t port = 0;
  auto operator<=>(const WireSender&) const = default;
};

/// Receives a group's datagrams and no others: bound to the group's address, so that nothing sent to an
/// address of this host arrives; of a group that stays on this host, only what came over its loopback device.
class UdpReceiver {
 public:
  /// Port 0: any free one. std::runtime_error with the remedy.
  explicit UdpReceiver(const UdpAddress& address);
  ~UdpReceiver();
  UdpReceiver(const UdpReceiver&) = delete;
  UdpReceiver& operator=(const UdpReceiver&) = delete;

  /// The next whole datagram that waits, valid until the next call; false if none does. Does not wait.
  bool receive(std::span<const std::uint8_t>& datagram, WireSender& sender);
  /// Waits for a datagram, up to `timeout_ms`.
  bool wait(int timeout_ms) const;
  std::uint16_t port() const;
  /// To wait for it beside others.
  int fd() const { return fd_; }

 private:
  void join(const UdpAddress& address);
  bool is_ours(msghdr& message) const;

  int fd_;
  int loopback_ = 0;  ///< index of the only device that may bring something; 0: any
  in_addr group_;
  std::vector<std::uint8_t> buffer_;
};

/// Sends to a group and hears nothing, not even at the port that it sends from; open to all threads.
class UdpSender {
 public:
  /// std::runtime_error with the remedy.
  explicit UdpSender(const UdpAddress& address);
  ~UdpSender();
  UdpSender(const UdpSender&) = delete;
  UdpSender& operator=(const UdpSender&) = delete;

  /// False, with errno, if the datagram could not be sent.
  bool send(std::span<const std::uint8_t> datagram, std::uint16_t port) const;

 private:
  int fd_;
  in_addr group_;
};

}  // namespace trn
