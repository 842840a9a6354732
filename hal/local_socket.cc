#include "hal/local_socket.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <system_error>

#include "core/accounts.h"
#include "core/check.h"

namespace trn {

namespace {

constexpr int kBacklog = 32;
constexpr int kPacketsAtOnce = 64;  // of one connection, before the others' turn
constexpr int kAcceptsAtOnce = 8;
constexpr std::size_t kGroupsMax = 256;

std::runtime_error failure(const std::string& what, const std::string& path) {
  return std::runtime_error(fmt::format("{} {}: {}", what, path, std::strerror(errno)));
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw std::runtime_error(fmt::format("the path of a socket has 1 to {} bytes; '{}' has {}",
                                         sizeof address.sun_path - 1, path, path.size()));
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

int open_socket(int flags) {
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | flags, 0);
  if (fd < 0) throw failure("no local socket", "");
  return fd;
}

// Nothing but a socket is removed: a path that was mistyped must not cost a file.
void make_way(const std::string& path) {
  struct stat info {};
  if (lstat(path.c_str(), &info) != 0) return;
  if (!S_ISSOCK(info.st_mode))
    throw std::runtime_error(
        fmt::format("{} is in the way of the daemon's socket and is none; remove it", path));
  unlink(path.c_str());
}

// The file has no right at all until it is its group's.
void bind_for(int fd, const std::string& path, gid_t group) {
  const sockaddr_un address = address_of(path);
  make_way(path);
  const mode_t before = umask(0777);
  const int bound = bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  umask(before);
  if (bound != 0) throw failure("no socket can be made at", path);
  const bool shared = group != static_cast<gid_t>(-1);
  if (shared && !give_to_group(path, group)) throw failure("the socket cannot be given to its group:", path);
  if (chmod(path.c_str(), shared ? 0660 : 0600) != 0)
    throw failure("the socket's rights cannot be set:", path);
  if (listen(fd, kBacklog) != 0) throw failure("nobody can connect to", path);
}

// Nothing if the peer has gone already.
bool read_peer(int fd, Peer& peer) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return false;
  std::vector<gid_t> groups(kGroupsMax);
  socklen_t bytes = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  if (getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &bytes) != 0) bytes = 0;
  groups.resize(bytes / sizeof(gid_t));
  groups.insert(groups.begin(), credentials.gid);
  peer = {credentials.pid, credentials.uid, std::move(groups), user_name(credentials.uid)};
  return true;
}

// Of a whole packet; 0: none waits; -1: the other side has ended.
ssize_t receive(int fd, std::vector<std::uint8_t>& buffer) {
  const ssize_t size = recv(fd, buffer.data(), buffer.size(), MSG_DONTWAIT | MSG_TRUNC);
  if (size > 0) return std::min(size, static_cast<ssize_t>(buffer.size()));
  return size < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : -1;
}

}  // namespace

bool give_to_group(const std::string& path, gid_t group) {
  struct stat info {};
  if (lstat(path.c_str(), &info) == 0 && info.st_gid == group) return true;
  return chown(path.c_str(), static_cast<uid_t>(-1), group) == 0;
}

bool Peer::is_in(gid_t group) const { return std::find(groups.begin(), groups.end(), group) != groups.end(); }

std::string Peer::text() const { return fmt::format("{}, process {}", user, pid); }

LocalServer::LocalServer(const std::string& path, gid_t group, WhenFull when_full)
    : path_(path), when_full_(when_full), buffer_(kDatagramBytesMax) {
  listen_anew(group);
}

void LocalServer::listen_anew(gid_t group) {
  const int fd = open_socket(SOCK_NONBLOCK);
  struct stat info {};
  try {
    bind_for(fd, path_, group);
    if (lstat(path_.c_str(), &info) != 0) throw failure("no socket is at", path_);
  } catch (...) {
    close(fd);
    throw;
  }
  if (fd_ >= 0) close(fd_);
  fd_ = fd;
  device_ = info.st_dev;
  inode_ = info.st_ino;
}

bool LocalServer::holds_path() const {
  struct stat info {};
  return lstat(path_.c_str(), &info) == 0 && info.st_dev == device_ && info.st_ino == inode_;
}

LocalServer::~LocalServer() {
  if (holds_path()) unlink(path_.c_str());
  close(fd_);
  for (const auto& [id, connection] : connections_) close(connection.fd);
}

const Peer* LocalServer::peer(ConnectionId connection) const {
  const auto found = connections_.find(connection);
  return found == connections_.end() ? nullptr : &found->second.peer;
}

std::size_t LocalServer::connections_of(uid_t uid) const {
  return static_cast<std::size_t>(
      std::count_if(connections_.begin(), connections_.end(),
                    [&](const auto& other) { return other.second.peer.uid == uid; }));
}

// Ids rise, so the first of a user is its oldest.
void LocalServer::drop_oldest(uid_t uid) {
  const auto oldest = std::find_if(connections_.begin(), connections_.end(),
                                   [&](const auto& other) { return other.second.peer.uid == uid; });
  if (oldest != connections_.end()) drop(oldest->first);
}

// Of this user first; where many users have filled all places, of the one who has the most.
bool LocalServer::make_room(const Peer& peer) {
  const bool own_full = connections_of(peer.uid) >= kConnectionsOfUserMax;
  if (!own_full && connections_.size() < kConnectionsMax) return true;
  if (when_full_ == WhenFull::kRefuse) return false;
  uid_t from = peer.uid;
  if (!own_full)
    for (const auto& [id, connection] : connections_)
      if (connections_of(connection.peer.uid) > connections_of(from)) from = connection.peer.uid;
  drop_oldest(from);
  return true;
}

// False if nobody waits.
bool LocalServer::accept_new() {
  const int fd = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return false;
  Connection made{fd, {}};
  if (!read_peer(fd, made.peer) || !make_room(made.peer)) {
    close(fd);
    return true;
  }
  connections_.emplace(++last_id_, std::move(made));
  TRN_CHECK(connections_.size() <= kConnectionsMax);
  if (welcome_) welcome_(last_id_);
  return true;
}

void LocalServer::take_from(ConnectionId id) {
  for (int i = 0; i < kPacketsAtOnce; ++i) {
    const auto found = connections_.find(id);
    if (found == connections_.end()) return;
    const ssize_t size = receive(found->second.fd, buffer_);
    if (size < 0) return drop(id);
    if (size == 0) return;
    sender_ = id;
    dispatcher_.accept(std::span(buffer_).first(static_cast<std::size_t>(size)));
  }
}

void LocalServer::drop(ConnectionId id) {
  const auto found = connections_.find(id);
  if (found == connections_.end()) return;
  close(found->second.fd);
  connections_.erase(found);
}

bool LocalServer::handle(int timeout_ms) {
  std::vector<pollfd> waited{{fd_, POLLIN, 0}};
  std::vector<ConnectionId> ids;
  for (const auto& [id, connection] : connections_) {
    waited.push_back({connection.fd, POLLIN, 0});
    ids.push_back(id);
  }
  if (poll(waited.data(), waited.size(), timeout_ms) <= 0) return false;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (waited[i + 1].revents != 0) take_from(ids[i]);
  for (int i = 0; waited[0].revents != 0 && i < kAcceptsAtOnce && accept_new();) ++i;
  return true;
}

bool LocalServer::send_packet(ConnectionId to, const EncodedMessage& message) {
  const auto found = connections_.find(to);
  if (found == connections_.end() || !message.error.empty()) return false;
  const auto& bytes = message.datagram;
  return ::send(found->second.fd, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
}

void LocalServer::broadcast_packet(const EncodedMessage& message) {
  for (const auto& [id, connection] : connections_) send_packet(id, message);
}

LocalClient::LocalClient(const std::string& path) : fd_(open_socket(0)), buffer_(kDatagramBytesMax) {
  const sockaddr_un address = address_of(path);
  const bool connected = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (connected && read_peer(fd_, server_)) return;
  const int error = errno;
  close(fd_);
  throw std::system_error(error, std::generic_category(), path);
}

LocalClient::~LocalClient() { close(fd_); }

bool LocalClient::send_packet(std::span<const std::uint8_t> packet) {
  if (::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL) >= 0) return true;
  closed_ = errno == EPIPE || errno == ECONNRESET || errno == ENOTCONN;
  return false;
}

bool LocalClient::handle(int timeout_ms) {
  pollfd waited{fd_, POLLIN, 0};
  if (closed_ || poll(&waited, 1, timeout_ms) <= 0) return false;
  const ssize_t size = receive(fd_, buffer_);
  closed_ = size < 0;
  return size > 0 && dispatcher_.accept(std::span(buffer_).first(static_cast<std::size_t>(size)));
}

}  // namespace trn
