#include "app/gateway/source_gate.h"

#include <algorithm>

namespace trn {

// Where too many are known, the one that has been silent longest is forgotten.
void SourceGate::note_false(const WireSender& sender, Clock::time_point now) {
  if (!sources_.contains(sender) && sources_.size() >= kSourcesMax)
    sources_.erase(std::min_element(sources_.begin(), sources_.end(), [](const auto& a, const auto& b) {
      return a.second.asked() < b.second.asked();
    }));
  sources_.try_emplace(sender, kFalseRate, kFalseBurst, now).first->second.take(now);
}

}  // namespace trn
