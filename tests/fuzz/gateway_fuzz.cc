#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/client/command_rights.h"
#include "app/client/command_table.h"
#include "app/client/signed_message.h"
#include "app/client/signing_key.h"
#include "app/gateway/counter_file.h"
#include "app/gateway/gateway.h"
#include "hal/lcm_messages.h"
#include "hal/message_codec.h"
#include "hal/udp_group.h"
#include "tests/fuzz/require.h"

// Fuzz target: what a network says to the gateway: datagrams of any bytes, messages of any fields with any
// bytes inside, by holders of three keys (one a role), by others in their name, repeated, out of order, from
// many senders. What it hands on must have been signed by a key that may send it, be of a counter above every
// earlier one of that key, and be the very message that was signed.
namespace {

using namespace trn;
using fuzz::require;
using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::sensor_t;
using trunnion::signed_command_t;

constexpr const char* kMachine = "m";
constexpr std::array kNames = {"looks", "operates", "sets_up"};
constexpr double kRateHz = 50;

SigningKey::Seed seed_of(std::size_t number) {
  SigningKey::Seed seed{};
  seed.front() = static_cast<std::uint8_t>(number + 1);
  return seed;
}

/// The holders' own keys, and one of somebody else.
const SigningKey& signing_key(std::size_t number) {
  static const std::array<std::unique_ptr<SigningKey>, 4> keys = [] {
    std::array<std::unique_ptr<SigningKey>, 4> made;
    for (std::size_t i = 0; i < made.size(); ++i)
      made[i] = std::make_unique<SigningKey>(i < kNames.size() ? kNames[i] : "stranger", seed_of(i));
    return made;
  }();
  return *keys[number];
}

/// A gateway whose counters lie in memory, and what it was told and has handed on.
class Bench {
 public:
  Bench() : folder_(temporary()), counters_(folder_ + "/counters.json", kMachine), gateway_(make_gateway()) {}
  ~Bench() { std::filesystem::remove_all(folder_); }

  void receive(const signed_command_t& message, std::optional<std::size_t> signer, const WireSender& from) {
    if (signer && *signer < kNames.size() && message.key == kNames[*signer]) truly_signed_.push_back(message);
    gateway_.receive(message, from, now_);
  }
  void hand_on() { gateway_.hand_on(); }
  void answered(const acknowledge_t& answer) { gateway_.answered(answer); }
  void wait(std::chrono::milliseconds time) { now_ += time; }
  void tell_refusals() { gateway_.refusals().news(now_); }

 private:
  static std::string temporary() {
    const std::string folder = "/dev/shm/trunnion_gateway_fuzz." + std::to_string(getpid());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directory(folder);
    return folder;
  }
  Gateway make_gateway() {
    std::vector<Gateway::Key> keys;
    for (std::size_t i = 0; i < kNames.size(); ++i)
      keys.push_back({kNames[i], signing_key(i).public_key(), static_cast<Role>(i)});
    return Gateway(kMachine, keys, kRateHz, counters_,
                   {[this](const command_t& command) { return hand_on_command(command); },
                    [this](const sensor_t& readings) { return hand_on_readings(readings); },
                    [](const acknowledge_t& answer) {
                      require(answer.outcome != acknowledge_t::REFUSED || !answer.message.empty(),
                              "a refusal says why");
                    }});
  }

  // The message that was handed on, of all that were truly signed.
  template <typename Is>
  void require_signed(std::int8_t kind, Is is) {
    const auto found =
        std::find_if(truly_signed_.begin(), truly_signed_.end(), [&](const signed_command_t& message) {
          return message.kind == kind && message.counter > last_[message.key] && is(message);
        });
    require(found != truly_signed_.end(), "what is handed on was signed, under a counter that is new");
    last_[found->key] = found->counter;
  }

  bool hand_on_command(const command_t& command) {
    require_signed(signed_command_t::COMMAND, [&](const signed_command_t& message) {
      auto inner = decode_inner<command_t>(message.inner);
      const std::size_t holder = holder_of(message.key);
      if (!inner || role_for(*inner) > static_cast<Role>(holder)) return false;
      if (!makes_safe(*inner) && inner->expires_us == 0) return false;
      inner->client = Gateway::daemon_client(signing_key(holder).public_key(), inner->client);
      return encode_inner(*inner) == encode_inner(command);
    });
    return command.sequence % 3 != 0;  // now and then no daemon can be reached
  }
  bool hand_on_readings(const sensor_t& readings) {
    require_signed(signed_command_t::SENSOR, [&](const signed_command_t& message) {
      const auto inner = decode_inner<sensor_t>(message.inner);
      return inner && holder_of(message.key) > 0 && encode_inner(*inner) == encode_inner(readings);
    });
    return true;
  }
  static std::size_t holder_of(const std::string& key) {
    return static_cast<std::size_t>(std::find(kNames.begin(), kNames.end(), key) - kNames.begin());
  }

  std::string folder_;
  CounterFile counters_;
  Gateway::Clock::time_point now_{std::chrono::hours(1)};
  std::vector<signed_command_t> truly_signed_;
  std::map<std::string, std::int64_t> last_;  ///< counters handed on
  Gateway gateway_;
};

/// A command whose fields come from the input, well formed or cut.
std::vector<std::uint8_t> inner_of(fuzz::Bytes& bytes, bool sensor) {
  const std::uint8_t form = bytes.byte();
  if (form % 4 == 0) {
    const auto raw = bytes.some(bytes.byte());
    return {raw.begin(), raw.end()};
  }
  std::vector<std::uint8_t> inner;
  if (sensor) {
    sensor_t readings{};
    readings.count = bytes.byte() % 3;
    for (int i = 0; i < readings.count; ++i) {
      readings.name.emplace_back("t");
      readings.value.push_back(bytes.byte());
    }
    inner = encode_inner(readings);
  } else {
    command_t command{};
    command.client = bytes.byte() % 4 + 1;
    command.sequence = bytes.byte();
    command.expires_us = bytes.byte() % 2;
    command.verb = static_cast<std::int8_t>(bytes.byte());
    command.value = bytes.byte() / 64.0;
    inner = encode_inner(command);
  }
  if (form % 8 == 7 && !inner.empty()) inner[bytes.byte() % inner.size()] ^= bytes.byte();
  return inner;
}

void send_signed(Bench& bench, fuzz::Bytes& bytes,
                 std::vector<std::pair<signed_command_t, std::optional<std::size_t>>>& sent) {
  const std::uint8_t who = bytes.byte();
  const std::size_t signer = who % 4, named = who / 4 % 4;
  const std::int64_t counter = bytes.byte();
  const std::int8_t kind = static_cast<std::int8_t>(bytes.byte() % 4);
  auto message = sign_message(signing_key(signer), kMachine, counter, kind,
                              inner_of(bytes, kind == signed_command_t::SENSOR));
  if (who >= 128 && named < kNames.size())
    message.key = kNames[named];  // in somebody's name, perhaps his own
  const bool damaged = bytes.byte() % 5 == 0;
  if (damaged) message.counter ^= bytes.byte() | 1;
  const auto true_signer = damaged ? std::nullopt : std::optional(signer);
  sent.push_back({message, true_signer});
  bench.receive(message, true_signer, {bytes.byte(), 1});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  spdlog::set_level(spdlog::level::off);
  Bench bench;
  fuzz::Bytes bytes(data, size);
  std::vector<std::pair<signed_command_t, std::optional<std::size_t>>> sent;
  while (!bytes.empty() && sent.size() < 200) {
    const std::uint8_t what = bytes.byte();
    if (what < 160) {
      send_signed(bench, bytes, sent);
    } else if (what < 180 && !sent.empty()) {  // a datagram once more
      const auto& [message, signer] = sent[bytes.byte() % sent.size()];
      bench.receive(message, signer, {bytes.byte(), 2});
    } else if (what < 200) {
      if (const auto message = decode_inner<signed_command_t>(bytes.some(bytes.byte())))
        bench.receive(*message, std::nullopt, {bytes.byte(), 3});
    } else if (what < 240) {
      bench.hand_on();
    } else if (what < 250) {
      bench.wait(std::chrono::milliseconds(4 * bytes.byte()));
      bench.tell_refusals();
    } else {
      acknowledge_t answer{};
      answer.client =
          Gateway::daemon_client(signing_key(bytes.byte() % 3).public_key(), bytes.byte() % 4 + 1);
      answer.sequence = bytes.byte();
      answer.message = "done";
      bench.answered(answer);
    }
  }
  bench.hand_on();
  return 0;
}
