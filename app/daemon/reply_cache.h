#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <utility>

#include "hal/lcm_messages.h"

namespace trn {

/// The last answers by (client, sequence), so that a command heard twice is answered twice and obeyed once.
/// Bounded: the oldest answers are forgotten, long after their commands have expired.
class ReplyCache {
 public:
  static constexpr std::size_t kCapacity = 4096;

  /// The answer to this command so far, or nullptr if it is new.
  const trunnion::acknowledge_t* find(const trunnion::command_t& command) const;
  /// Enters or replaces an answer.
  void enter(const trunnion::acknowledge_t& answer);

 private:
  using Key = std::pair<std::int64_t, std::int32_t>;
  std::map<Key, trunnion::acknowledge_t> answers_;
  std::deque<Key> oldest_first_;
};

}  // namespace trn
