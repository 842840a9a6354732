#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/message_codec.h"

namespace trn {

/// Who is at the other end of a local socket, as the kernel says (SO_PEERCRED, SO_PEERGROUPS): nobody can say
/// it of somebody else.
struct Peer {
  pid_t pid = 0;
  uid_t uid = 0;
  std::vector<gid_t> groups;  ///< the primary one first
  std::string user;           ///< as /etc/passwd names it; a number if it does not

  bool is_in(gid_t group) const;
  /// "anna, process 4242".
  std::string text() const;
};

/// Makes a file its group's; true at once where it is already, since a service may be kept from chown(2).
/// errno if false.
bool give_to_group(const std::string& path, gid_t group);

/// Of one server, counted from 1; no number is given twice.
using ConnectionId = std::uint64_t;

/// Messages between processes of one host, over a Unix socket of whole packets (SOCK_SEQPACKET) in LCM's wire
/// form. This is the side that is asked: it serves many connections from one thread and waits for none of
/// them. What a client does not read in time is lost to that client.
class LocalServer {
 public:
  static constexpr std::size_t kConnectionsMax = 64;
  static constexpr std::size_t kConnectionsOfUserMax = 24;

  /// Who comes when there is no room is sent away, or takes the place of the oldest connection. The second
  /// is for clients that connect, say one thing and go: nobody keeps them out by connections that he holds.
  enum class WhenFull : std::uint8_t { kRefuse, kDropOldest };

  /// Listens at `path`, where nothing may be but a socket of before, which is removed. `group` may use it
  /// besides this user; -1: nobody else. std::runtime_error with what is wrong.
  LocalServer(const std::string& path, gid_t group, WhenFull when_full = WhenFull::kRefuse);
  /// Removes the file at `path`, if it still is this server's.
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  template <typename Message>
  void subscribe(const std::string& channel, std::function<void(const Message&)> receive) {
    dispatcher_.subscribe<Message>(channel, std::move(receive));
  }
  /// Hears of each connection that is made, before anything comes from it.
  void on_connect(std::function<void(ConnectionId)> welcome) { welcome_ = std::move(welcome); }

  /// To one connection; false if it is gone or does not read.
  template <typename Message>
  bool send(ConnectionId to, const std::string& channel, const Message& message) {
    return send_packet(to, encode_message(sequence_++, channel, message));
  }
  /// To all connections that read.
  template <typename Message>
  void broadcast(const std::string& channel, const Message& message) {
    if (!connections_.empty()) broadcast_packet(encode_message(sequence_++, channel, message));
  }

  /// Waits up to `timeout_ms` for something, then takes what is there: a bounded number of packets of each
  /// connection, in turn. False if nothing came.
  bool handle(int timeout_ms);

  /// Of the message that is being handled.
  ConnectionId sender() const { return sender_; }
  /// Null if the connection is gone.
  const Peer* peer(ConnectionId connection) const;
  /// Packets that were no sound message of a channel that is listened to.
  std::uint64_t dropped() const { return dispatcher_.dropped(); }
  const std::string& path() const { return path_; }
  /// The file at `path` is this server's. If not, somebody has removed or replaced it, and nobody can
  /// connect.
  bool holds_path() const;
  /// Makes a file for this server at `path` again, in the place of any socket that is there; connections
  /// stay. std::runtime_error.
  void listen_anew(gid_t group);

 private:
  struct Connection {
    int fd = -1;
    Peer peer;
  };

  bool accept_new();
  std::size_t connections_of(uid_t uid) const;
  bool make_room(const Peer& peer);
  void drop_oldest(uid_t uid);
  void take_from(ConnectionId id);
  bool send_packet(ConnectionId to, const EncodedMessage& message);
  void broadcast_packet(const EncodedMessage& message);
  void drop(ConnectionId id);

  std::string path_;
  WhenFull when_full_;
  int fd_ = -1;
  dev_t device_ = 0;  ///< with the inode: of the socket's file
  ino_t inode_ = 0;
  std::map<ConnectionId, Connection> connections_;
  ConnectionId last_id_ = 0, sender_ = 0;
  std::uint32_t sequence_ = 0;
  MessageDispatcher dispatcher_;
  std::function<void(ConnectionId)> welcome_;
  std::vector<std::uint8_t> buffer_;
};

/// The side that asks. Not thread-safe.
class LocalClient {
 public:
  /// std::system_error where nothing listens at `path`, or this user may not use it.
  explicit LocalClient(const std::string& path);
  ~LocalClient();
  LocalClient(const LocalClient&) = delete;
  LocalClient& operator=(const LocalClient&) = delete;

  template <typename Message>
  void subscribe(const std::string& channel, std::function<void(const Message&)> receive) {
    dispatcher_.subscribe<Message>(channel, std::move(receive));
  }
  /// False if the server is gone. Waits while it does not read.
  template <typename Message>
  bool publish(const std::string& channel, const Message& message) {
    return send_packet(encode_message(sequence_++, channel, message).datagram);
  }
  /// One packet as it is, sound or not.
  bool send_packet(std::span<const std::uint8_t> packet);

  /// Waits up to `timeout_ms` for one message and hands it on; false if none came.
  bool handle(int timeout_ms);
  /// The server has ended the connection.
  bool closed() const { return closed_; }
  /// To wait for it beside others.
  int fd() const { return fd_; }
  /// Whose server it is.
  const Peer& server() const { return server_; }

 private:
  int fd_ = -1;
  bool closed_ = false;
  Peer server_;
  std::uint32_t sequence_ = 0;
  MessageDispatcher dispatcher_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace trn
