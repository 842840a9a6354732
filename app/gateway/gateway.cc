#include "app/gateway/gateway.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "app/client/command_table.h"
#include "app/client/signed_message.h"
#include "core/safe_file.h"
#include "hal/message_codec.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::sensor_t;
using trunnion::signed_command_t;

constexpr double kRepeatRate = 20, kTellRate = 20;

std::string_view name_of(const command_t& command) {
  const CommandRow* row = find_command(command.verb);
  return row ? row->name : "?";
}

}  // namespace

std::int64_t Gateway::daemon_client(const PublicKey& key, std::int64_t client) {
  return static_cast<std::int64_t>(mixed_number(key, static_cast<std::uint64_t>(client)) >> 1) | 1;
}

Gateway::Gateway(std::string machine, const std::vector<Key>& keys, double rate_hz_max, CounterFile& counters,
                 Outlets outlets)
    : machine_(std::move(machine)), counters_(counters), outlets_(std::move(outlets)) {
  const Clock::time_point begin{};
  for (const Key& key : keys)
    holders_.emplace(key.name, Holder{key,
                                      counters.last(key.name),
                                      {rate_hz_max, rate_hz_max, begin},
                                      {kRepeatRate, kRepeatRate, begin},
                                      {kTellRate, kTellRate, begin},
                                      {}});
}

// What costs least is looked at first; the signature costs most.
void Gateway::receive(const signed_command_t& message, const WireSender& from, Clock::time_point now) {
  const auto found = holders_.find(message.key);
  if (found == holders_.end()) return refusals_.note(Refusal::kUnknownKey);
  Holder& holder = found->second;
  const bool is_new = message.counter > holder.last;
  if (!is_new && !find_asked(holder, message.counter)) return refusals_.note(Refusal::kOldCounter);
  if (!sources_.may_try(from, now)) return refusals_.note(Refusal::kTooManyFalse);
  if (!is_true(message, machine_, holder.key.key)) {
    sources_.note_false(from, now);
    return refusals_.note(Refusal::kFalseSignature);
  }
  if (is_new)
    receive_true(holder, message, now);
  else
    repeat_answer(holder, message.counter, now);
}

void Gateway::receive_true(Holder& holder, const signed_command_t& message, Clock::time_point now) {
  holder.last = message.counter;
  if (message.kind == signed_command_t::COMMAND) {
    if (const auto command = decode_inner<command_t>(message.inner))
      return receive_command(holder, message.counter, *command, now);
  } else if (message.kind == signed_command_t::SENSOR) {
    if (const auto readings = decode_inner<sensor_t>(message.inner))
      return receive_sensor(holder, message.counter, *readings, now);
  }
  refusals_.note(Refusal::kNoMessage);
}

void Gateway::receive_command(Holder& holder, std::int64_t counter, const command_t& command,
                              Clock::time_point now) {
  const std::string& name = holder.key.name;
  const Role role = role_for(command);
  const bool safe = makes_safe(command);
  const bool again = std::any_of(holder.asked.begin(), holder.asked.end(), [&](const Asked& asked) {
    return asked.client == command.client && asked.sequence == command.sequence;
  });
  if (holder.asked.size() >= kAskedMax) holder.asked.pop_front();
  holder.asked.push_back({counter, command.client, daemon_client(holder.key.key, command.client),
                          command.sequence, std::nullopt});
  if (role > holder.key.role) {
    refusals_.note(Refusal::kRole);
    if (holder.tellings.take(now)) tell(holder, command, "refused, no right to it");
    return refuse(
        holder, counter,
        fmt::format("key '{}' may not {} this machine: that needs role = \"{}\" in its [[gateway.key]]", name,
                    to_string(role), to_string(role)));
  }
  if (!safe && !holder.rate.take(now)) {
    refusals_.note(Refusal::kRate);
    // The daemon may have acted on it already: then a refusal would be untrue, and silence makes the client
    // ask once more.
    if (again) return;
    return refuse(holder, counter,
                  "too many commands of this key: [gateway] rate_hz_max; send it again later");
  }
  // Somebody on the way may hold a message back for as long as he likes, as no counter tells how old it is.
  if (!safe && command.expires_us == 0) {
    refusals_.note(Refusal::kNoExpiry);
    return refuse(holder, counter, "a command from another host must expire ('expires_us')");
  }
  if (holder.tellings.take(now)) tell(holder, command, "let in");
  waiting_.push_back({&holder, counter, command, std::nullopt});
}

void Gateway::receive_sensor(Holder& holder, std::int64_t counter, const sensor_t& readings,
                             Clock::time_point now) {
  if (holder.key.role < Role::kOperate) return refusals_.note(Refusal::kRole);
  if (!holder.rate.take(now)) return refusals_.note(Refusal::kRate);
  waiting_.push_back({&holder, counter, std::nullopt, readings});
}

void Gateway::tell(Holder& holder, const command_t& command, const std::string& what) {
  spdlog::info("key '{}' ({}): {}, client {}, command {}: {}", holder.key.name, to_string(holder.key.role),
               name_of(command), daemon_client(holder.key.key, command.client), command.sequence, what);
}

Gateway::Asked* Gateway::find_asked(Holder& holder, std::int64_t counter) {
  const auto found = std::find_if(holder.asked.begin(), holder.asked.end(),
                                  [&](const Asked& asked) { return asked.counter == counter; });
  return found == holder.asked.end() ? nullptr : &*found;
}

void Gateway::repeat_answer(Holder& holder, std::int64_t counter, Clock::time_point now) {
  const Asked* asked = find_asked(holder, counter);
  if (asked && asked->answer && holder.repeats.take(now)) outlets_.answer(*asked->answer);
}

void Gateway::hand_on() {
  if (waiting_.empty()) return;
  std::string refused;
  try {
    for (const Waiting& waiting : waiting_) counters_.raise(waiting.holder->key.name, waiting.counter);
    counters_.save();
  } catch (const FileError& error) {
    refused = fmt::format("the gateway cannot keep its counters: {}", error.what());
    spdlog::error("{}", refused);
  }
  for (const Waiting& waiting : waiting_) hand_on(waiting, refused);
  waiting_.clear();
}

void Gateway::hand_on(const Waiting& waiting, const std::string& refused) {
  if (waiting.sensor) {
    if (refused.empty()) outlets_.sensor(*waiting.sensor);
    return;
  }
  command_t command = *waiting.command;
  if (!refused.empty() && !makes_safe(command)) return refuse(*waiting.holder, waiting.counter, refused);
  command.client = daemon_client(waiting.holder->key.key, command.client);
  if (!outlets_.command(command))
    refuse(*waiting.holder, waiting.counter,
           "the gateway reaches no daemon of this machine; nothing happened");
}

void Gateway::refuse(Holder& holder, std::int64_t counter, const std::string& why) {
  Asked* asked = find_asked(holder, counter);
  if (!asked) return;
  acknowledge_t answer{};
  answer.client = asked->client;
  answer.sequence = asked->sequence;
  answer.outcome = acknowledge_t::REFUSED;
  answer.message = why;
  asked->answer = answer;
  outlets_.answer(answer);
}

void Gateway::answered(const acknowledge_t& answer) {
  for (auto& [name, holder] : holders_) {
    std::optional<acknowledge_t> told;
    for (Asked& asked : holder.asked) {
      if (asked.daemon_client != answer.client || asked.sequence != answer.sequence) continue;
      told = answer;
      told->client = asked.client;
      asked.answer = told;
    }
    if (told) outlets_.answer(*told);
  }
}

}  // namespace trn
