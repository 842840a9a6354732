#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"
#include "hal/wire_layout.h"
#include "tests/fuzz/require.h"

// Fuzz target: any bytes as a datagram from whoever sends to the daemon's group, all types of message
// listened to. What is handed on is, encoded again, the same bytes; what is not was counted or was not for
// us.
namespace {

using trn::fuzz::require;

struct Heard {
  std::vector<std::uint8_t> encoded;
  int messages = 0;
};

template <typename Message>
void listen(trn::LcmLink& link, const std::string& channel, Heard& heard) {
  link.subscribe<Message>(channel, [&heard](const Message& message) {
    ++heard.messages;
    heard.encoded.resize(static_cast<std::size_t>(message.getEncodedSize()));
    const int size = static_cast<int>(heard.encoded.size());
    require(message.encode(heard.encoded.data(), 0, size) == size, "what was decoded can be encoded");
  });
}

void listen_to_all(trn::LcmLink& link, Heard& heard) {
  listen<trunnion::acknowledge_t>(link, "m.acknowledge", heard);
  listen<trunnion::alarms_t>(link, "m.alarms", heard);
  listen<trunnion::command_t>(link, "m.command", heard);
  listen<trunnion::motion_t>(link, "m.motion", heard);
  listen<trunnion::sensor_t>(link, "m.sensor", heard);
  listen<trunnion::scope_request_t>(link, "m.scope_request", heard);
  listen<trunnion::scope_data_t>(link, "m.scope_data", heard);
  listen<trunnion::scope_signals_t>(link, "m.scope_signals", heard);
  listen<trunnion::signed_command_t>(link, "m.signed", heard);
  listen<trunnion::status_t>(link, "m.status", heard);
  listen<trunnion::tables_t>(link, "m.tables", heard);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  trn::LcmLink link("memq://");
  Heard heard;
  listen_to_all(link, heard);
  const std::span<const std::uint8_t> datagram(data, size);
  const bool accepted = link.accept(datagram);
  require(heard.messages == (accepted ? 1 : 0), "one message of an accepted datagram, none of another");
  require(!accepted || link.dropped() == 0, "what was handed on was not dropped");
  if (!accepted) return 0;
  const auto message = trn::read_datagram(datagram);
  require(message && std::ranges::equal(message->payload, heard.encoded), "the same bytes again");
  return 0;
}
