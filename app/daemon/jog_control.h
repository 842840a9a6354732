#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/daemon/direction_jog.h"
#include "app/daemon/held_jogs.h"
#include "app/daemon/jog_order.h"
#include "app/session/program_step.h"
#include "core/axes.h"
#include "core/ports.h"
#include "hal/lcm_messages.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"

namespace trn {

/// The daemon's jogs: what moves for them, and who still holds it.
class JogControl {
 public:
  using Time = HeldJogs::Time;
  /// In place of a joint: the jog along a direction, of which there is one at a time.
  static constexpr int kDirection = HeldJogs::kDirection;

  /// `joints`: with the limits that jogs keep. Without kinematics there are no words, without a map no
  /// directions.
  JogControl(const Joints& joints, const Kinematics* kinematics, const MachineJointMap* map)
      : joints_(joints), kinematics_(kinematics), map_(map) {}

  JogOrder order(const trunnion::command_t& command, const CycleReport& report) const;
  /// `step`: between programs; null: not known.
  DirectionOrder direction(const trunnion::command_t& command, const CycleReport& report,
                           const ProgramStep* step) const;

  /// While a program is held: the same as a way of stretches, which begins here. `step`: of the program.
  DirectionOrder begin_way(const trunnion::command_t& command, const CycleReport& report,
                           const ProgramStep* step);
  bool on_way() const { return way_ != 0; }
  /// From where the machine stands; the way ends where there is none.
  const std::vector<JogStretch>& next_stretch(const CycleReport& report, const ProgramStep* step);
  const std::vector<JogStretch>& stretch() const { return stretch_; }
  void forget_way() { way_ = 0; }

  /// Why this one is not obeyed: somebody else holds the joint, and this would be a step or the other way;
  /// "": nobody does.
  std::string held_by_other(const JogOrder& order, const trunnion::command_t& command, Time now) const;
  /// Who holds the joint now, and which way.
  void hold(const JogOrder& order, const trunnion::command_t& command, Time now);
  /// It has begun, or whoever holds it has said so again.
  void hear(int joint, const trunnion::command_t& command, Time now);
  void hear_direction(const trunnion::command_t& command, Time now);
  /// Says again what the last jog along a direction was told.
  bool continues(const trunnion::command_t& command) const;
  /// A joint, or kDirection, whose client has been silent for too long; each is told once.
  std::optional<int> take_silent(Time now) { return held_.take_silent(now); }

 private:
  Joints joints_;
  const Kinematics* kinematics_;
  const MachineJointMap* map_;
  HeldJogs held_;
  struct Holder {
    std::int64_t client = 0;
    bool back = false;
    Time until{};
  };
  std::array<Holder, kMaxJoints> holders_;
  trunnion::command_t direction_{};  ///< the last one
  DirectionWish wish_;               ///< of the way
  double way_ = 0, way_speed_ = 0;   ///< what is left of it; 0: there is none
  std::vector<JogStretch> stretch_;  ///< that was begun last
};

}  // namespace trn
