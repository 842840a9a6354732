#include "app/daemon/reply_cache.h"

#include "core/check.h"

namespace trn {

const trunnion::acknowledge_t* ReplyCache::find(uid_t user, const trunnion::command_t& command) const {
  const auto found = answers_.find({user, command.client, command.sequence});
  return found == answers_.end() ? nullptr : &found->second;
}

void ReplyCache::enter(uid_t user, const trunnion::acknowledge_t& answer) {
  const Key key{user, answer.client, answer.sequence};
  if (answers_.insert_or_assign(key, answer).second) oldest_first_.push_back(key);
  TRN_CHECK(answers_.size() == oldest_first_.size());
  if (oldest_first_.size() <= kCapacity) return;
  answers_.erase(oldest_first_.front());
  oldest_first_.pop_front();
}

}  // namespace trn
