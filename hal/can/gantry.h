#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "core/ports.h"
#include "core/realtime.h"
#include "hal/can/point_move.h"

namespace trn {

/// One joint on several motors, as the tick sees it: what each motor is told, and whether they go together.
/// Every motor finds its own home switch. Then all are drawn to one place, slowly: the gantry is square.
/// Pure; mm or rad.
class Gantry {
 public:
  static constexpr int kMotorsMax = 4;
  struct Config {
    int joint = 0;
    std::string name;  ///< of the joint, for messages
    double unit = 1;   ///< mm or rad of one unit of messages
    std::string unit_name = "mm";
    int motors = 2;                                              ///< how many, at most kMotorsMax
    double apart_max = std::numeric_limits<double>::infinity();  ///< between two motors, as they should stand
    double apart_homing_max = std::numeric_limits<double>::infinity();  ///< while each looks for its switch
    double step_max = std::numeric_limits<double>::infinity();  ///< more in a period is a new zero, no motion
    PointMove::Limits squaring, final;
    double home_final = std::numeric_limits<double>::quiet_NaN();  ///< behind homing; none: it stays
    double near = 1e-3;                                            ///< so close to home_final it has arrived
  };
  /// What a motor shows in this period.
  struct Motor {
    double q = 0;
    bool enabled = false, homing = false, homed = false;
  };
  using Motors = std::array<Motor, kMotorsMax>;
  struct Demand {
    double q = 0, qd = 0;
    bool follow = false;
  };

  explicit Gantry(const Config& config);

  /// Before the motors' steps: goes on with a squaring or final move.
  void advance() TRN_RT;
  /// What motor `i` is told when the joint is told `q`, `qd`.
  Demand demand(int i, double q, double qd, bool follow) const TRN_RT;
  /// Behind the motors' steps. False: they have parted, all must stop.
  bool observe(const Motors& motors) TRN_RT;

  /// kEnabled, or what the joint as a whole is still about.
  DriveState state() const TRN_RT;
  double measured() const TRN_RT { return mean_; }
  /// Distance between the two motors that are farthest from each other, beyond what they should have.
  double apart() const TRN_RT { return apart_; }
  const Config& config() const TRN_RT { return config_; }

 private:
  enum class Phase : std::uint8_t {
    kOff,        ///< not all motors have power
    kPaired,     ///< the zeros are unknown: each keeps its distance to the others
    kSearching,  ///< each looks for its switch
    kSquaring,   ///< drawn to one place
    kFinal,      ///< together to where homing ends
    kReady
  };

  void pair(const Motors& motors) TRN_RT;
  void begin_squaring(bool homed_now) TRN_RT;
  void search(const Motors& motors) TRN_RT;
  double spread(const std::array<double, kMotorsMax>& places) const TRN_RT;
  void change_phase(const Motors& motors) TRN_RT;

  Config config_;
  Phase phase_ = Phase::kOff;
  std::array<double, kMotorsMax> offset_{};  ///< of each motor's setpoint from the joint's
  std::array<double, kMotorsMax> paired_{};  ///< the same, when they were paired
  std::array<double, kMotorsMax> travel_{};  ///< of each since the search began
  std::array<double, kMotorsMax> before_{};  ///< place in the period before
  double offset_max_ = 0;                    ///< greatest of paired_
  double base_ = 0;                          ///< of the joint while it is drawn square
  double mean_ = 0, apart_ = 0;
  bool homed_now_ = false;  ///< this squaring is the end of homing
  PointMove move_;          ///< squaring: of the greatest offset; final: of the joint
};

}  // namespace trn
