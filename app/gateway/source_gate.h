#pragma once

#include <map>

#include "app/gateway/token_bucket.h"
#include "hal/udp_group.h"

namespace trn {

/// Whose signatures are looked at. To find one false takes about as long as to receive fifty datagrams, so a
/// sender of many false ones is looked at so often and no oftener; others always. Some of its messages are
/// looked at whatever it sends, for somebody else may send in its name.
class SourceGate {
 public:
  using Clock = TokenBucket::Clock;
  static constexpr double kFalseRate = 5000, kFalseBurst = 100;  ///< of one sender, a second; at once
  static constexpr std::size_t kSourcesMax = 256;  ///< senders of false ones that are known at a time

  bool may_try(const WireSender& sender, Clock::time_point now) {
    const auto found = sources_.find(sender);
    return found == sources_.end() || found->second.has(now);
  }
  /// The signature of this sender was false.
  void note_false(const WireSender& sender, Clock::time_point now);

 private:
  std::map<WireSender, TokenBucket> sources_;
};

}  // namespace trn
