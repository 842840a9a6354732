#include "hal/can/socket_can.h"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "core/check.h"

namespace trn {

namespace {

constexpr std::size_t kBatch = 64;

std::string error_text(int error) { return std::strerror(error); }

[[noreturn]] void fail(const std::string& interface, const std::string& what, int error) {
  if (error == EAFNOSUPPORT)
    throw std::runtime_error(fmt::format(
        "{}: this kernel has no CAN; load it with: modprobe can_raw (or use one that has it)", interface));
  throw std::runtime_error(fmt::format("{}: {}: {}", interface, what, error_text(error)));
}

ifreq request_for(const std::string& interface) {
  ifreq request{};
  std::strncpy(request.ifr_name, interface.c_str(), IFNAMSIZ - 1);
  return request;
}

bool is_up(int fd, const std::string& interface) {
  ifreq request = request_for(interface);
  return ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP);
}

std::string how_to_start(const std::string& interface) {
  return fmt::format(
      "bring it up: ip link set {0} type can bitrate 1000000 restart-ms 100; ip link set {0} up", interface);
}

void bind_to(int fd, const std::string& interface) {
  const unsigned index = if_nametoindex(interface.c_str());
  if (index == 0) {
    std::string known;
    for (const CanInterface& other : can_interfaces()) known += (known.empty() ? "" : ", ") + other.name;
    throw std::runtime_error(fmt::format("there is no interface '{}'; this host has: {}", interface,
                                         known.empty() ? "no CAN interface" : known));
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
    fail(interface, "is it a CAN interface? binding failed", errno);
  if (!is_up(fd, interface))
    throw std::runtime_error(fmt::format("interface {} is down; {}", interface, how_to_start(interface)));
}

void set_filters(int fd, const std::string& interface, const std::vector<CanFilter>& filters) {
  std::vector<can_filter> kernel;
  for (const CanFilter& filter : filters)
    kernel.push_back({filter.id, filter.mask | CAN_EFF_FLAG});  // 11-bit identifiers only
  const auto size = static_cast<socklen_t>(kernel.size() * sizeof(can_filter));
  if (!kernel.empty() && setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, kernel.data(), size) != 0)
    fail(interface, "the kernel refuses the filters", errno);
  // Bus-off and restart of the controller come as frames. A kernel or driver without them leaves the state as
  // it was, so a refusal here is no error.
  const can_err_mask_t errors = CAN_ERR_MASK;
  setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
}

CanFrame from_kernel(const canfd_frame& in, bool fd) TRN_RT {
  CanFrame out;
  out.extended = in.can_id & CAN_EFF_FLAG;
  out.remote = in.can_id & CAN_RTR_FLAG;
  out.error = in.can_id & CAN_ERR_FLAG;
  out.fd = fd;
  out.id = in.can_id & (out.extended || out.error ? CAN_EFF_MASK : CAN_SFF_MASK);
  out.size = std::min<std::uint8_t>(in.len, fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN);
  std::copy_n(in.data, out.size, out.data.begin());
  return out;
}

canfd_frame to_kernel(const CanFrame& in) TRN_RT {
  canfd_frame out{};
  out.can_id = in.id | (in.extended ? CAN_EFF_FLAG : 0) | (in.remote ? CAN_RTR_FLAG : 0);
  out.len = in.size;
  if (in.fd) out.flags = CANFD_BRS;
  std::copy_n(in.data.begin(), std::min<std::size_t>(in.size, CANFD_MAX_DLEN), out.data);
  return out;
}

std::int64_t stamp_of(msghdr& header) TRN_RT {
  for (cmsghdr* item = CMSG_FIRSTHDR(&header); item; item = CMSG_NXTHDR(&header, item)) {
    if (item->cmsg_level != SOL_SOCKET || item->cmsg_type != SO_TIMESTAMPNS) continue;
    timespec time;
    std::memcpy(&time, CMSG_DATA(item), sizeof time);
    return time.tv_sec * 1'000'000'000LL + time.tv_nsec;
  }
  return 0;
}

}  // namespace

struct SocketCan::Buffers {
  alignas(8) std::array<std::array<char, 64>, kBatch> control;
  std::array<canfd_frame, kBatch> frames;
  std::array<iovec, kBatch> parts;
  std::array<mmsghdr, kBatch> headers;
};

std::vector<CanInterface> can_interfaces() {
  std::vector<CanInterface> out;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  struct if_nameindex* all = if_nameindex();
  for (struct if_nameindex* one = all; one && one->if_index != 0; ++one) {
    ifreq request = request_for(one->if_name);
    if (ioctl(fd, SIOCGIFHWADDR, &request) != 0 || request.ifr_hwaddr.sa_family != ARPHRD_CAN) continue;
    CanInterface interface;
    interface.name = one->if_name;
    interface.up = is_up(fd, interface.name);
    interface.is_virtual = interface.name.rfind("vcan", 0) == 0;
    if (ioctl(fd, SIOCGIFMTU, &request) == 0) interface.fd = request.ifr_mtu == static_cast<int>(CANFD_MTU);
    if (ioctl(fd, SIOCGIFTXQLEN, &request) == 0) interface.queue_length = request.ifr_qlen;
    out.push_back(interface);
  }
  if (all) if_freenameindex(all);
  if (fd >= 0) close(fd);
  return out;
}

SocketCan::SocketCan(const std::string& interface, const std::vector<CanFilter>& filters)
    : interface_(interface), buffers_(std::make_unique<Buffers>()) {
  fd_ = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd_ < 0) fail(interface, "no CAN socket", errno);
  try {
    // Before binding, or the first frames would come unfiltered.
    set_filters(fd_, interface, filters);
    const int on = 1;
    setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    ifreq request = request_for(interface);
    const bool has_fd =
        ioctl(fd_, SIOCGIFMTU, &request) == 0 && request.ifr_mtu == static_cast<int>(CANFD_MTU);
    fd_frames_ = has_fd && setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) == 0;
    bind_to(fd_, interface);
  } catch (...) {
    close(fd_);
    throw;
  }
}

SocketCan::~SocketCan() { close(fd_); }

void SocketCan::confirm_sends() {
  const int on = 1;
  setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &on, sizeof on);
}

std::int64_t SocketCan::now_ns() const TRN_RT {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

// A full queue (ENOBUFS) or socket buffer (EAGAIN) takes nothing more in this period; the caller counts.
int SocketCan::send(std::span<const CanFrame> frames) TRN_RT {
  Buffers& b = *buffers_;
  const std::size_t count = std::min(frames.size(), kBatch);
  for (std::size_t i = 0; i < count; ++i) {
    b.frames[i] = to_kernel(frames[i]);
    b.parts[i] = {&b.frames[i], frames[i].fd ? sizeof(canfd_frame) : sizeof(can_frame)};
    b.headers[i] = {};
    b.headers[i].msg_hdr.msg_iov = &b.parts[i];
    b.headers[i].msg_hdr.msg_iovlen = 1;
  }
  if (count == 0) return 0;
  // The kernel's stamps are of the wall clock, everything else here of the monotonic one. The difference is
  // taken anew at each send, so a clock that is set does not matter for longer than a period.
  timespec real;
  clock_gettime(CLOCK_REALTIME, &real);  // what the kernel's stamps are of
  clock_offset_ns_ = now_ns() - (real.tv_sec * 1'000'000'000LL + real.tv_nsec);
  const int taken = sendmmsg(fd_, b.headers.data(), static_cast<unsigned>(count), MSG_DONTWAIT);
  if (taken < 0) take_errno(errno);
  return std::max(taken, 0);
}

// The kernel gives back the own frames among the others (Linux, can.rst, 4.1.4). They take no room here, so
// one call may need several rounds until the room is filled or nothing is left.
int SocketCan::receive(std::span<CanFrame> frames) TRN_RT {
  const std::size_t room = std::min(frames.size(), kBatch);
  std::size_t taken = 0;
  for (int round = 0; round < kRoundsMax && taken < room; ++round) {
    const std::size_t asked = room - taken;
    const int count = read_batch(asked);
    // Frames come: the interface is up again.
    if (count > 0 && state_ == BusState::kDown) state_ = BusState::kOnline;
    for (int i = 0; i < count; ++i)
      if (take_message(static_cast<std::size_t>(i), frames[taken])) ++taken;
    if (count < static_cast<int>(asked)) break;
  }
  TRN_CHECK(taken <= room);
  return static_cast<int>(taken);
}

// How many messages are in the buffers now; 0 also where the interface says why there are none.
int SocketCan::read_batch(std::size_t room) TRN_RT {
  TRN_CHECK(room > 0 && room <= kBatch);
  Buffers& b = *buffers_;
  for (std::size_t i = 0; i < room; ++i) {
    b.parts[i] = {&b.frames[i], sizeof(canfd_frame)};
    b.headers[i] = {};
    b.headers[i].msg_hdr.msg_iov = &b.parts[i];
    b.headers[i].msg_hdr.msg_iovlen = 1;
    b.headers[i].msg_hdr.msg_control = b.control[i].data();
    b.headers[i].msg_hdr.msg_controllen = b.control[i].size();
  }
  const int count = recvmmsg(fd_, b.headers.data(), static_cast<unsigned>(room), MSG_DONTWAIT, nullptr);
  if (count < 0) take_errno(errno);
  return std::max(count, 0);
}

// False: an own frame, now out.
bool SocketCan::take_message(std::size_t i, CanFrame& frame) TRN_RT {
  Buffers& b = *buffers_;
  const std::int64_t stamp_ns = stamp_of(b.headers[i].msg_hdr);
  // The kernel marks frames that this very socket has sent; they come back once they were on the bus.
  if (b.headers[i].msg_hdr.msg_flags & MSG_CONFIRM) {
    confirmed_ns_ = stamp_ns + clock_offset_ns_;
    return false;
  }
  frame = from_kernel(b.frames[i], b.headers[i].msg_len == sizeof(canfd_frame));
  frame.time_ns = stamp_ns;
  if (frame.error) take_error_frame(frame);
  return true;
}

void SocketCan::take_error_frame(const CanFrame& frame) TRN_RT {
  if (frame.id & CAN_ERR_BUSOFF) state_ = BusState::kBusOff;
  if (frame.id & CAN_ERR_RESTARTED) state_ = BusState::kOnline;
}

void SocketCan::take_errno(int error) TRN_RT {
  if (error == ENETDOWN || error == ENODEV || error == ENXIO) state_ = BusState::kDown;
}

void SocketCan::wait(std::int64_t timeout_ns) {
  pollfd waiting{fd_, POLLIN, 0};
  const timespec timeout{timeout_ns / 1'000'000'000, timeout_ns % 1'000'000'000};
  const bool error_only = ppoll(&waiting, 1, &timeout, nullptr) > 0 && !(waiting.revents & POLLIN);
  if (!error_only) return;
  int error = 0;  // pending on the socket; read, or poll would return at once for ever
  socklen_t size = sizeof error;
  getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size);
  take_errno(error);
  // An interface that is down makes poll return at once. Without the pause the caller would spin until it is
  // up.
  std::this_thread::sleep_for(std::chrono::nanoseconds(timeout_ns));
}

// Down and up again restarts a controller that is off the bus; it needs CAP_NET_ADMIN.
std::string SocketCan::recover() {
  if (if_nametoindex(interface_.c_str()) == 0)
    return fmt::format("interface {} is gone; plug it in again", interface_);
  ifreq request = request_for(interface_);
  const bool known = ioctl(fd_, SIOCGIFFLAGS, &request) == 0;
  if (known && state_ == BusState::kBusOff && (request.ifr_flags & IFF_UP)) {
    request.ifr_flags = static_cast<short>(request.ifr_flags & ~IFF_UP);
    ioctl(fd_, SIOCSIFFLAGS, &request);
  }
  if (known && !is_up(fd_, interface_)) {
    request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP);
    ioctl(fd_, SIOCSIFFLAGS, &request);
  }
  if (!is_up(fd_, interface_))
    return fmt::format("interface {} is down; {}", interface_, how_to_start(interface_));
  state_ = BusState::kOnline;
  return "";
}

}  // namespace trn
