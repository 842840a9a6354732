#include "panel/server/fleet.h"

#include <arpa/inet.h>

#include <array>
#include <cstdint>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>

#include "hal/message_codec.h"
#include "hal/wire_layout.h"

namespace trn {

namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr std::string_view kStatusEnding = ".status";
constexpr int kDatagramsAtOnce = 200;
constexpr auto kForgotten = 60s, kHeard = 3s, kTellEvery = 1s;

std::string text_of(const WireSender& sender) {
  const bool own = sender.address == 0 || sender.address >> 24 == 127;  // a group that stays on the host
  if (own) return "this computer";
  const in_addr address{htonl(sender.address)};
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

}  // namespace

Fleet::Fleet(const std::string& url, std::map<std::string, std::string> pages) : pages_(std::move(pages)) {
  if (url.empty()) {
    silent_ = "'[lcm] url' of this machine is empty, so no other machine is heard.";
    return;
  }
  try {
    in_ = std::make_unique<UdpReceiver>(UdpAddress::parse(url));
  } catch (const std::exception& error) {
    silent_ = error.what();
  }
}

void Fleet::take(std::span<const std::uint8_t> datagram, const WireSender& sender, Clock::time_point now) {
  const std::optional<WireMessage> message = read_datagram(datagram);
  if (!message || !message->channel.ends_with(kStatusEnding)) return;
  auto status = decode_inner<trunnion::status_t>(message->payload);
  const std::string name(message->channel.substr(0, message->channel.size() - kStatusEnding.size()));
  if (!status || status->machine != name) return;
  if (seen_.size() >= kMachinesMax && !seen_.contains(name)) return;
  seen_[name] = {std::move(*status), sender, now};
}

bool Fleet::step(Clock::time_point now) {
  std::span<const std::uint8_t> datagram;
  WireSender sender;
  for (int i = 0; in_ && i < kDatagramsAtOnce && in_->receive(datagram, sender); ++i)
    take(datagram, sender, now);
  if (now - told_ < kTellEvery) return false;
  told_ = now;
  std::erase_if(seen_, [&](const auto& one) { return now - one.second.heard > kForgotten; });
  return true;  // who is silent grows older
}

json Fleet::machines(Clock::time_point now) const {
  json out = json::array();
  for (const auto& [name, seen] : seen_) {
    const trunnion::status_t& status = seen.status;
    const auto page = pages_.find(name);
    out.push_back({{"name", name},
                   {"host", text_of(seen.sender)},
                   {"page", page == pages_.end() ? "" : page->second},
                   {"heard", now - seen.heard < kHeard},
                   {"version", status.version},
                   {"state", status.state},
                   {"fault", status.fault},
                   {"alarm", status.alarm},
                   {"alarms_open", status.alarms_open},
                   {"waits_for", status.waits_for},
                   {"program", status.program},
                   {"line", status.line},
                   {"tool_name", status.tool_name},
                   {"time_total_s", status.time_total_s},
                   {"time_left_s", status.time_left_s},
                   {"parts", status.parts},
                   {"run_s", status.run_s}});
  }
  return out;
}

}  // namespace trn
