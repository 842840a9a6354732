#include "app/daemon/reply_cache.h"

#include "core/check.h"

namespace trn {

const trunnion::acknowledge_t* ReplyCache::find(uid_t user, const trunnion::command_t& command) const {
  const Key key{user, command.client, command.sequence};
  for (const auto* answers : {&working_, &final_})
    if (const auto found = answers->find(key); found != answers->end()) return &found->second;
  return nullptr;
}

void ReplyCache::enter(uid_t user, const trunnion::acknowledge_t& answer) {
  const Key key{user, answer.client, answer.sequence};
  if (answer.outcome == trunnion::acknowledge_t::WORKING) {
    working_[key] = answer;
    if (working_.size() > kCapacity) working_.erase(working_.begin());
    return;
  }
  working_.erase(key);
  if (final_.insert_or_assign(key, answer).second) oldest_first_.push_back(key);
  TRN_CHECK(final_.size() == oldest_first_.size());
  if (oldest_first_.size() <= kCapacity) return;
  final_.erase(oldest_first_.front());
  oldest_first_.pop_front();
}

}  // namespace trn
