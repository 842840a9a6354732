#include "sim/modbus/emulated_line.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>

namespace trn {

namespace {
constexpr int kPollMs = 20, kClosedMs = 1;

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", what, std::strerror(errno)));
}
}  // namespace

EmulatedLine::EmulatedLine(const ModbusAddress& address, const std::vector<int>& units)
    : tcp_(!address.host.empty()) {
  for (const int unit : units) units_[unit];
  tcp_ ? listen_on(address.port) : open_terminal(address.device);
  thread_ = std::thread([this] { serve(); });
}

EmulatedLine::~EmulatedLine() {
  stop_ = true;
  thread_.join();
  for (const Client& client : clients_) close(client.fd);
  if (listener_ >= 0) close(listener_);
  if (!link_.empty()) unlink(link_.c_str());
}

void EmulatedLine::listen_on(int port) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  // A rehearsal that is started again at once finds the port free, though old connections are still closing.
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in here{};
  here.sin_family = AF_INET;
  // This host only: nobody else has anything to ask of an emulated cabinet.
  here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  here.sin_port = htons(static_cast<std::uint16_t>(port));
  sockaddr general{};
  std::memcpy(&general, &here, sizeof general);
  const bool good = bind(listener_, &general, sizeof here) == 0 && listen(listener_, 8) == 0;
  if (good) return;
  close(listener_);
  fail(fmt::format("no Modbus server on port {} of this host", port));
}

// Raw, so that no byte means anything to the terminal.
void EmulatedLine::open_terminal(const std::string& name) {
  const int fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  std::array<char, 64> other{};
  const bool good =
      fd >= 0 && grantpt(fd) == 0 && unlockpt(fd) == 0 && ptsname_r(fd, other.data(), other.size()) == 0;
  if (!good) fail("no pseudo-terminal");
  termios settings{};
  tcgetattr(fd, &settings);
  cfmakeraw(&settings);
  tcsetattr(fd, TCSANOW, &settings);
  struct stat status {};
  // A link that an earlier run has left behind. Anything else of this name, such as a real serial line,
  // stays.
  if (lstat(name.c_str(), &status) == 0 && S_ISLNK(status.st_mode)) unlink(name.c_str());
  clients_.push_back({fd, {}});
  if (symlink(other.data(), name.c_str()) != 0) {
    close(fd);
    fail(fmt::format("the serial line {} cannot be given this name", name));
  }
  link_ = name;
}

void EmulatedLine::set(int unit, ModbusTable table, int address, std::uint16_t value) {
  const std::lock_guard lock(mutex_);
  units_[unit].device.set(table, address, value);
}

std::uint16_t EmulatedLine::get(int unit, ModbusTable table, int address) const {
  const std::lock_guard lock(mutex_);
  const auto found = units_.find(unit);
  return found == units_.end() ? std::uint16_t{0} : found->second.device.get(table, address);
}

void EmulatedLine::set_block(int unit, ModbusTable table, int first,
                             const std::vector<std::uint16_t>& values) {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < values.size(); ++i)
    units_[unit].device.set(table, first + static_cast<int>(i), values[i]);
}

std::vector<std::uint16_t> EmulatedLine::block(int unit, ModbusTable table, int first, int count) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint16_t> out;
  for (int i = 0; i < count; ++i) out.push_back(units_.at(unit).device.get(table, first + i));
  return out;
}

void EmulatedLine::trouble(int unit, const Trouble& trouble) {
  const std::lock_guard lock(mutex_);
  units_[unit].trouble = trouble;
}

void EmulatedLine::serve() {
  while (!stop_) {
    std::vector<pollfd> waiting;
    for (const Client& client : clients_) waiting.push_back({client.fd, POLLIN, 0});
    if (tcp_) waiting.push_back({listener_, POLLIN, 0});
    poll(waiting.data(), waiting.size(), kPollMs);
    if (tcp_ && waiting.back().revents) accept_client();
    // From the last one, so that erasing does not move those still to come.
    for (std::size_t i = clients_.size(); i-- > 0;) {
      const bool ready = i < waiting.size() && waiting[i].fd == clients_[i].fd && waiting[i].revents;
      if (!ready || read_from(clients_[i]) || !tcp_) continue;
      close(clients_[i].fd);
      clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    // A terminal that nobody has open says so at once, again and again. A master opens it anew behind a
    // time-out, and its next request must not find a sleeper that lets it time out as well.
    if (!tcp_ && (waiting[0].revents & POLLHUP))
      std::this_thread::sleep_for(std::chrono::milliseconds(kClosedMs));
  }
}

void EmulatedLine::accept_client() {
  const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd >= 0) clients_.push_back({fd, {}});
}

bool EmulatedLine::read_from(Client& client) {
  std::array<std::uint8_t, 512> in;
  const ssize_t count = read(client.fd, in.data(), in.size());
  if (count <= 0) return count < 0 && errno == EAGAIN;
  client.bytes.insert(client.bytes.end(), in.begin(), in.begin() + count);
  // One read may hold several requests, or a part of one.
  while (const auto request = tcp_ ? take_tcp_request(client.bytes) : take_rtu_request(client.bytes))
    answer(client.fd, *request);
  return true;
}

EmulatedDevice::Pdu EmulatedLine::answer_of(const ModbusRequest& request, Trouble& trouble) {
  const std::lock_guard lock(mutex_);
  const auto found = units_.find(request.unit);
  if (found == units_.end()) return {};
  trouble = found->second.trouble;
  EmulatedDevice::Pdu pdu = found->second.device.answer(request.pdu);
  // Functions 3 and 4 answer with registers; a lie is added to each of them.
  const bool registers = pdu[0] == 3 || pdu[0] == 4;
  for (std::size_t i = 2; registers && trouble.lie != 0 && i + 1 < pdu.size(); i += 2) {
    const int value = (pdu[i] << 8 | pdu[i + 1]) + trouble.lie;
    pdu[i] = static_cast<std::uint8_t>(value >> 8);
    pdu[i + 1] = static_cast<std::uint8_t>(value);
  }
  return pdu;
}

void EmulatedLine::noise(std::uint32_t seed) {
  const std::lock_guard lock(mutex_);
  noise_.emplace(seed);
}

void EmulatedLine::no_noise() {
  const std::lock_guard lock(mutex_);
  noise_.reset();
}

bool EmulatedLine::make_noise(const ModbusRequest& request, const EmulatedDevice::Pdu& truth,
                              std::vector<std::uint8_t>& bytes) {
  const std::lock_guard lock(mutex_);
  if (!noise_) return false;
  std::mt19937& random = *noise_;
  // The nearer noise comes to a sound answer, the further into the master's checks it gets.
  const unsigned kind = random() % 8;  // 0: nothing fits; 1 to 7: ever more does
  EmulatedDevice::Pdu pdu(kind == 7 && !truth.empty() ? truth.size() : 1 + random() % 40);
  for (std::uint8_t& byte : pdu) byte = static_cast<std::uint8_t>(random());
  if (kind >= 2) pdu[0] = static_cast<std::uint8_t>(request.pdu[0] | (random() % 4 == 0 ? 0x80 : 0));
  if (kind >= 4 && pdu.size() > 1) pdu[1] = static_cast<std::uint8_t>(pdu.size() - 2);
  bytes = tcp_ ? tcp_answer(request, pdu) : rtu_answer(request, pdu);
  if (kind == 0)
    std::generate(bytes.begin(), bytes.end(), [&] { return static_cast<std::uint8_t>(random()); });
  if (kind == 5) bytes.resize(1 + random() % bytes.size());
  return true;
}

void EmulatedLine::answer(int fd, const ModbusRequest& request) {
  ++requests_;
  std::vector<std::uint8_t> bytes;
  Trouble trouble;
  const EmulatedDevice::Pdu pdu = answer_of(request, trouble);
  if (!make_noise(request, pdu, bytes)) {
    if (pdu.empty() || trouble.silent) return;
    if (trouble.late_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(trouble.late_ms));
    bytes = tcp_ ? tcp_answer(request, pdu) : rtu_answer(request, pdu);
    if (trouble.is_short) bytes.resize(bytes.size() / 2);
  }
  if (write(fd, bytes.data(), bytes.size()) < 0) return;  // gone; the next read tells
}

}  // namespace trn
