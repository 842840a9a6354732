#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/client/command_rights.h"
#include "app/client/signing_key.h"
#include "app/gateway/counter_file.h"
#include "app/gateway/refusal_log.h"
#include "app/gateway/source_gate.h"
#include "app/gateway/token_bucket.h"
#include "hal/lcm_messages.h"
#include "hal/udp_group.h"

namespace trn {

/// Judges signed messages from a network and hands on those that a known key may send, each once. Has no
/// socket of its own.
class Gateway {
 public:
  using Clock = TokenBucket::Clock;

  struct Key {
    std::string name;
    PublicKey key;
    Role role = Role::kLook;
  };
  struct Outlets {
    /// To the daemon; false if it cannot be reached.
    std::function<bool(const trunnion::command_t&)> command;
    std::function<bool(const trunnion::sensor_t&)> sensor;
    /// To the network.
    std::function<void(const trunnion::acknowledge_t&)> answer;
  };

  /// `counters` must outlive it. `rate_hz_max`: commands and readings a second of one key; what makes the
  /// machine safe always passes.
  Gateway(std::string machine, const std::vector<Key>& keys, double rate_hz_max, CounterFile& counters,
          Outlets outlets);

  /// Judges one message. What may pass waits for `hand_on`.
  void receive(const trunnion::signed_command_t& message, const WireSender& from, Clock::time_point now);
  /// Hands on what waits, in the order in which it came, once the counters are on the disk. Where they cannot
  /// be kept, what makes the machine safe is handed on all the same, and nothing else.
  void hand_on();
  /// The daemon's answer to something that was handed on.
  void answered(const trunnion::acknowledge_t& answer);

  RefusalLog& refusals() { return refusals_; }
  /// The client id under which the daemon sees a client of this key: nobody can spend the numbers of somebody
  /// else's client.
  static std::int64_t daemon_client(const PublicKey& key, std::int64_t client);

 private:
  static constexpr std::size_t kAskedMax = 64;  ///< commands of one key whose answers are known

  /// A command that was let in, or refused under its key's name.
  struct Asked {
    std::int64_t counter = 0, client = 0, daemon_client = 0;
    std::int32_t sequence = 0;
    std::optional<trunnion::acknowledge_t> answer;
  };
  struct Holder {
    Key key;
    std::int64_t last = 0;  ///< counter of whatever was signed by it
    TokenBucket rate, repeats, tellings;
    std::deque<Asked> asked;
  };
  struct Waiting {
    Holder* holder;
    std::int64_t counter = 0;
    std::optional<trunnion::command_t> command;  // one of the two
    std::optional<trunnion::sensor_t> sensor;
  };

  void receive_true(Holder& holder, const trunnion::signed_command_t& message, Clock::time_point now);
  void receive_command(Holder& holder, std::int64_t counter, const trunnion::command_t& command,
                       Clock::time_point now);
  void receive_sensor(Holder& holder, std::int64_t counter, const trunnion::sensor_t& readings,
                      Clock::time_point now);
  void repeat_answer(Holder& holder, std::int64_t counter, Clock::time_point now);
  void hand_on(const Waiting& waiting, const std::string& refused);
  void refuse(Holder& holder, std::int64_t counter, const std::string& why);
  static Asked* find_asked(Holder& holder, std::int64_t counter);
  void tell(Holder& holder, const trunnion::command_t& command, const std::string& what);

  std::string machine_;
  std::map<std::string, Holder, std::less<>> holders_;
  CounterFile& counters_;
  Outlets outlets_;
  SourceGate sources_;
  RefusalLog refusals_;
  std::vector<Waiting> waiting_;
};

}  // namespace trn
