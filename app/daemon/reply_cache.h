#pragma once

#include <sys/types.h>

#include <cstdint>
#include <deque>
#include <map>
#include <tuple>

#include "hal/lcm_messages.h"

namespace trn {

/// The last answers by (user, client, sequence), so that a command heard twice is answered twice and obeyed
/// once. Bounded: the oldest final answers are forgotten, long after their commands have expired. What is
/// being worked at is not: it may take longer than a flood of other commands takes to fill the cache.
class ReplyCache {
 public:
  static constexpr std::size_t kCapacity = 4096;

  /// The answer to this command so far, or nullptr if it is new.
  const trunnion::acknowledge_t* find(uid_t user, const trunnion::command_t& command) const;
  /// Enters or replaces an answer.
  void enter(uid_t user, const trunnion::acknowledge_t& answer);

 private:
  // Of one user: nobody can spend the numbers of somebody else's client.
  using Key = std::tuple<uid_t, std::int64_t, std::int32_t>;
  std::map<Key, trunnion::acknowledge_t> working_, final_;
  std::deque<Key> oldest_first_;  ///< of the final ones
};

}  // namespace trn
