#pragma once

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/touch_probe.h"

namespace trn {

/// What the tick remembers of a probe move (G38): the contact, where the joints were at it, and how long it
/// has waited for a touch probe on the drives' own inputs. Such drives latch their positions at the edge of
/// the probe's signal, and tell them some periods later; without them, the joints' measured places at the end
/// of the period before the one that sees the contact have to do.
class ProbeMove {
 public:
  enum class Wait : unsigned char { kGoesOn, kOver, kFailed };

  /// `drives` must outlive it; `joints`: how many the machine has.
  ProbeMove(Drives& drives, std::size_t joints);

  /// In front of the move, once a period: arms the drives' probe. The wait is always the same, so that a
  /// replay needs no answer of the drives. kFailed: they are not armed after it.
  Wait arm(ProbeMode mode) TRN_RT;
  /// The probe changed while the joints were at `q_measured`, mm or rad. The first call counts.
  void touch(const JointVec& q_measured) TRN_RT;
  bool touched() const TRN_RT { return touched_; }
  /// Behind the contact, once a period: waits for the places that the drives have latched. kFailed: not all
  /// of them have.
  Wait take_latched() TRN_RT;
  /// Where the joints were at the contact, mm or rad.
  const JointVec& q_contact() const TRN_RT { return q_contact_; }
  /// The move is over.
  void reset() TRN_RT;

  /// The signal at the drives' own inputs; false where they have none.
  bool drives_see_contact() const TRN_RT { return drives_ && drives_->touch().contact; }

 private:
  TouchDrives* drives_;  ///< null: no touch probe on the drives
  unsigned all_joints_;
  bool touched_ = false, taken_ = false;
  int waited_ = 0;  ///< periods, for the drives
  JointVec q_contact_;
};

}  // namespace trn
