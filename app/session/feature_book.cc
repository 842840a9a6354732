#include "app/session/feature_book.h"

namespace trn {

void FeatureBook::begin() {
  const std::lock_guard lock(mutex_);
  meter_ = FeatureMeter();
}

void FeatureBook::programmed(const ProgramMove& move) {
  const std::lock_guard lock(mutex_);
  meter_.programmed(move);
}

bool FeatureBook::report(const CycleReport& report) {
  const std::lock_guard lock(mutex_);
  meter_.sample(report);
  if (report.event.kind != QueueEvent::Kind::kProgramEnd) return false;
  std::vector<FeatureDeflection> features = meter_.features();
  if (features.empty()) return false;  // a line by hand leaves what the last part was like
  last_ = std::move(features);
  return true;
}

std::vector<FeatureDeflection> FeatureBook::last() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

}  // namespace trn
