#pragma once

#include <cstdint>

namespace trn {

/// Homing of a drive by itself, after the figures of CiA 402-2, clause 11: methods 1 to 14, 17 to 30, 33, 34,
/// 35 and 37. Places and speeds are the plant's (mm or rad); "positive" is the drive's own direction. Pure.
class EmulatedHoming {
 public:
  /// Where the axis has its switches. All are closed switches in true places.
  struct Switches {
    double home_low = 0, home_high = 0;    ///< the home switch is closed between these
    double limit_low = 0, limit_high = 0;  ///< the limit switches are closed beyond these
    double index = 0, index_pitch = 0;     ///< one index pulse, and the distance to the next; 0: the only one
  };
  struct Run {
    int method = 0;
    bool reverse = false;  ///< the drive's positive direction is the plant's negative one
    double fast = 0, slow = 0;
  };

  static bool knows(int method);
  /// Where the home point lies for a method, that the figures draw at a switch's edge: `edge` shifted so that
  /// the method finds its home point at `home`, the index `index_distance` behind the edge.
  static Switches at_home(int method, bool reverse, double home, double index_distance, double width);

  void begin(const Run& run, const Switches& switches, double place);
  /// Wanted speed, once a period; `home_dead`: the home switch stays open.
  double step(double place, bool home_dead);
  bool running() const { return phase_ != Phase::kIdle; }
  /// The axis only has to come to rest.
  bool stopping() const { return phase_ == Phase::kStop; }
  /// It has met no switch, or a limit switch that its figure does not have.
  bool failed() const { return failed_; }
  /// Why the last one failed, for people; "" if it did not.
  const char* why() const { return why_; }
  double home() const { return home_; }
  /// `why`: where it is given up.
  void end(const char* why = "") {
    phase_ = Phase::kIdle;
    if (*why) why_ = why;
  }

 private:
  enum class Phase : std::uint8_t { kIdle, kSearch, kLeave, kEdge, kIndex, kStop };
  enum class Which : std::uint8_t { kHome, kLow, kHigh };
  /// One method, in the plant's directions (-1, +1).
  struct Plan {
    Which which = Which::kHome;
    int search = 0;         ///< the way in which the switch is looked for
    int edge = 0;           ///< -1: its lower edge, +1: its upper one
    int final = 0;          ///< the way in which that edge is crossed
    bool reverses = false;  ///< at a limit switch
    bool index = false;
  };

  static bool plan_of(int method, bool reverse, Plan& plan);
  bool closed(double place, bool home_dead) const;
  double edge_place() const;
  double next_index(double from) const;
  double search(double place, bool home_dead);
  double cross_edge(double place, bool now);
  bool beyond_limit(double place, int way) const;
  double fail(const char* why);
  void go_for_index(double from);

  Run run_;
  Switches switches_;
  Plan plan_;
  Phase phase_ = Phase::kIdle;
  bool failed_ = false, turned_ = false, was_closed_ = false;
  int way_ = 0;
  double before_ = 0, home_ = 0;
  const char* why_ = "";
};

}  // namespace trn
