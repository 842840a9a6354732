#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "core/ports.h"
#include "core/realtime.h"
#include "core/touch_probe.h"
#include "hal/can/gantry.h"
#include "hal/can/node_link.h"

namespace trn {

/// The nodes of one gantry joint in the tick: told together, stopped together, reported as one joint.
class GantryLink {
 public:
  /// `motors` must outlive this.
  GantryLink(const Gantry::Config& config, std::vector<NodeLink*> motors);

  /// In place of the motors' own steps.
  void step(const Setpoints& setpoints, bool follow) TRN_RT;
  void reset() TRN_RT;
  /// Behind the motors' own reports: what they are together.
  void report(Feedback& feedback) const TRN_RT;
  void report_touch(TouchProbe& touch) const TRN_RT;

  bool homing() const TRN_RT { return gantry_.state() == DriveState::kHoming; }
  int joint() const { return gantry_.config().joint; }
  const Gantry& gantry() const { return gantry_; }
  /// Why they were stopped, in words; "" if they have not parted. Any thread.
  std::string explain() const;

 private:
  Gantry::Motors motors_now() const TRN_RT;
  bool one_has_failed() const TRN_RT;

  Gantry gantry_;
  std::vector<NodeLink*> motors_;
  std::atomic<double> parted_by_ = 0;  ///< when they were stopped; 0: they are together
};

}  // namespace trn
