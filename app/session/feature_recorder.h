#pragma once

#include <mutex>
#include <vector>

#include "app/session/feature_meter.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"

namespace trn {

/// What the tool's bending makes of a program that one thread plans and another one sees driven.
class FeatureRecorder {
 public:
  /// A program begins; nothing of the one before is driven any more.
  void begin();
  /// Its moves, before they are driven.
  void programmed(const ProgramMove& move);
  /// Every period, in order. True in that in which a program with features ended.
  bool report(const CycleReport& report);

  /// Of the program that ended last.
  std::vector<FeatureDeflection> last() const;

 private:
  mutable std::mutex mutex_;
  FeatureMeter meter_;
  std::vector<FeatureDeflection> last_;
};

}  // namespace trn
