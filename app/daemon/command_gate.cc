#include "app/daemon/command_gate.h"

#include <algorithm>

namespace trn {

namespace {

constexpr auto kTellAgain = std::chrono::minutes(1);

}  // namespace

bool CommandGate::Bucket::take(double rate, double burst, Clock::time_point now) {
  tokens = std::min(burst, tokens + rate * std::chrono::duration<double>(now - filled).count());
  filled = now;
  if (tokens < 1) return false;
  tokens -= 1;
  return true;
}

// Where too many are known, the one that has been silent longest is forgotten.
CommandGate::Bucket& CommandGate::bucket_of(const Sender& sender, Clock::time_point now) {
  const auto found = senders_.find(sender);
  if (found != senders_.end()) return found->second;
  if (senders_.size() >= kSendersMax)
    senders_.erase(std::min_element(senders_.begin(), senders_.end(), [](const auto& a, const auto& b) {
      return a.second.filled < b.second.filled;
    }));
  return senders_[sender] = {kSenderBurst, now};
}

bool CommandGate::admit(const Sender& sender, Clock::time_point now) {
  return bucket_of(sender, now).take(kSenderRate, kSenderBurst, now) &&
         total_.take(kTotalRate, kTotalBurst, now);
}

bool CommandGate::must_tell(Clock::time_point now) {
  if (now < quiet_until_) return false;
  quiet_until_ = now + kTellAgain;
  return true;
}

}  // namespace trn
