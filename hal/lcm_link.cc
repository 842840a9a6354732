#include "hal/lcm_link.h"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace trn {

namespace {

constexpr const char* kQueueUrl = "memq://";
constexpr int kDatagramsAtOnce = 64;

bool is_queue(const std::string& url) { return url.rfind(kQueueUrl, 0) == 0; }

void test_group(const std::string& url) {
  UdpAddress address = UdpAddress::parse(url);
  address.port = 0;  // any will do: what is in question is the way of the group's datagrams
  UdpReceiver receiver(address);
  const UdpSender sender(address);
  constexpr std::uint8_t kText[] = "trunnion";
  // A datagram of its own through the group tells more than any look at routes and devices: either it comes
  // back or it does not.
  const bool sent = sender.send(kText, receiver.port());
  std::span<const std::uint8_t> heard;
  WireSender from;
  if (sent && receiver.wait(500) && receiver.receive(heard, from)) return;
  const std::string why = sent ? "did not come back" : fmt::format("was not sent ({})", std::strerror(errno));
  const char* remedy = address.stays_here() ? "the loopback device must be up:\n  ip link set lo up"
                                            : "a route for multicast is needed, such as:\n"
                                              "  ip route add 224.0.0.0/4 dev DEVICE";
  throw std::runtime_error(
      fmt::format("LCM cannot work on this host: a datagram to {} {}; {}", address.text(), why, remedy));
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
  if (is_queue(url)) return "";
  try {
    test_group(url);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

LcmPublisher::LcmPublisher(const std::string& url) {
  if (url.empty()) return;
  address_ = UdpAddress::parse(url);
  out_.emplace(*address_);
}

std::string LcmPublisher::send(const EncodedMessage& message) const {
  if (!message.error.empty()) return message.error;
  return out_->send(message.datagram, address_->port)
             ? ""
             : fmt::format("LCM cannot send to {}: {}", address_->text(), std::strerror(errno));
}

LcmLink::LcmLink(const std::string& url) {
  if (is_queue(url)) return;
  const std::string bad = lcm_self_test(url);
  if (!bad.empty()) throw std::runtime_error(bad);
  address_ = UdpAddress::parse(url);
  out_.emplace(url);
}

void LcmLink::begin_receiving() {
  if (address_ && !in_) in_ = std::make_unique<UdpReceiver>(*address_);
}

std::string LcmLink::keep(EncodedMessage message) {
  if (!message.error.empty()) return message.error;
  const std::lock_guard lock(mutex_);
  queue_.push_back(std::move(message.datagram));
  return "";
}

bool LcmLink::take_queued(bool& handed_on) {
  std::vector<std::uint8_t> datagram;
  {
    const std::lock_guard lock(mutex_);
    if (queue_.empty()) return false;
    datagram = std::move(queue_.front());
    queue_.pop_front();
  }
  handed_on = accept(datagram);
  return true;
}

// False if nothing waited.
bool LcmLink::take_one(bool& handed_on) {
  handed_on = false;
  if (!address_) return take_queued(handed_on);
  std::span<const std::uint8_t> datagram;
  if (!in_ || !in_->receive(datagram, sender_)) return false;
  handed_on = accept(datagram);
  return true;
}

bool LcmLink::handle(int timeout_ms) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::milliseconds(timeout_ms);
  while (true) {
    bool waited_for = true, handed_on = false;
    for (int i = 0; i < kDatagramsAtOnce && waited_for; ++i) {
      waited_for = take_one(handed_on);
      if (handed_on) return true;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return false;
    // The time is not over and more may be there: the bound above is for the look at the clock only.
    if (waited_for) continue;
    if (in_)
      in_->wait(static_cast<int>(left.count()));
    else
      std::this_thread::sleep_for(left);
  }
}

}  // namespace trn
