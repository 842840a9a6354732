#include "app/session/feature_recorder.h"

#include "core/motion.h"

namespace trn {

void FeatureRecorder::begin() {
  const std::lock_guard lock(mutex_);
  meter_ = FeatureMeter();
}

void FeatureRecorder::programmed(const ProgramMove& move) {
  const std::lock_guard lock(mutex_);
  meter_.programmed(move);
}

bool FeatureRecorder::report(const CycleReport& report) {
  const std::lock_guard lock(mutex_);
  meter_.sample(report);
  if (report.event.kind != QueueEvent::Kind::kProgramEnd) return false;
  std::vector<FeatureDeflection> features = meter_.features();
  if (features.empty()) return false;  // a line by hand leaves what the last part was like
  last_ = std::move(features);
  return true;
}

std::vector<FeatureDeflection> FeatureRecorder::last() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

}  // namespace trn
