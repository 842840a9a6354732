#include "hal/can/sdo_talk.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "hal/can/frame.h"

namespace trn {

namespace {
constexpr std::int64_t kLook_ns = 2'000'000;
}

bool SdoTalk::transfer(SdoClient& client, ObjectKey key) {
  std::array<CanFrame, 64> in;
  CanFrame frame;
  bool waits = false;
  while (client.state() == SdoClient::State::kBusy) {
    if (!waits) waits = client.next_frame(frame);
    while (waits && bus_.send({&frame, 1}) == 1) waits = client.next_frame(frame);
    bus_.wait(kLook_ns);
    const int count = bus_.receive(in);
    for (int i = 0; i < count; ++i) client.receive(in[static_cast<std::size_t>(i)], bus_.now_ns());
    client.poll(bus_.now_ns());
  }
  while (client.next_frame(frame)) bus_.send({&frame, 1});
  code_ = client.abort_code();
  if (client.state() == SdoClient::State::kDone) return true;
  if (!client.aborted_by_node() && code_ != sdo_abort::kTimeout)
    throw SdoSilence(fmt::format(
        "node {}: the answer for {} is not legal ({}). End other programs that talk to this node, "
        "such as the daemon, and check that no other node has this id",
        node_, to_string(key), sdo_abort_text(code_)));
  if (!client.aborted_by_node())
    throw SdoSilence(
        fmt::format("node {}: {} was not answered ({}); check its supply, the node id and the bit rate, or "
                    "say a longer --timeout",
                    node_, to_string(key), sdo_abort_text(code_)));
  return false;
}

std::optional<std::vector<std::uint8_t>> SdoTalk::read(ObjectKey key) {
  SdoClient client({node_, timeout_ns_, 1 << 20, 64, false});
  client.read(key, bus_.now_ns());
  if (!transfer(client, key)) return std::nullopt;
  return client.data();
}

bool SdoTalk::write(ObjectKey key, std::uint64_t value, std::size_t bytes, std::int64_t timeout_ns) {
  std::array<std::uint8_t, 8> data{};
  put_le(data.data(), 8, value);
  SdoClient client({node_, timeout_ns, 1 << 20, 64, false});
  client.write(key, {data.data(), std::min<std::size_t>(bytes, 8)}, bus_.now_ns());
  return transfer(client, key);
}

std::vector<FoundNode> scan_nodes(CanEndpoint& bus, int last, std::int64_t timeout_ns) {
  std::vector<FoundNode> out;
  for (int id = 1; id <= last; ++id) {
    SdoTalk node(bus, id, timeout_ns);
    const auto number = [&](ObjectKey key) -> std::uint32_t {
      const auto data = node.read(key);
      if (!data || data->empty() || data->size() > 4) return 0;
      return static_cast<std::uint32_t>(get_le(data->data(), static_cast<int>(data->size())));
    };
    try {
      FoundNode found{id, number({0x1000, 0}), 0, 0, 0, 0};
      found.vendor = number({0x1018, 1});
      found.product = number({0x1018, 2});
      found.revision = number({0x1018, 3});
      found.serial = number({0x1018, 4});
      out.push_back(found);
    } catch (const SdoSilence&) {
      continue;  // nobody has this id
    }
  }
  return out;
}

}  // namespace trn
