#pragma once

#include <string>
#include <vector>

#include "compensation/screw_correction.h"
#include "compensation/screw_heat.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/machine.h"

namespace trn {

/// One ball screw of a simulated machine: what it is in truth, whatever the corrections believe.
struct SimulatedScrewConfig {
  ScrewConfig screw;        ///< its sensor: only channel, place and reference (the temperature of the air)
  double resolution_K = 0;  ///< of the sensor; 0: none
  double silent_from_s = 0, silent_to_s = 0;  ///< the sensor says nothing in between
};

/// The ball screws of a simulated machine: they warm up as it moves, put the nuts elsewhere, and their
/// sensors tell the board how warm they are, once a second. Outside the tick.
class SimulatedScrews {
 public:
  static constexpr int kNodes = 121;
  /// `board` must outlive the screws.
  SimulatedScrews(const std::vector<SimulatedScrewConfig>& screws, double period_s, SensorBoard& board);

  /// What the growth does at one place of one joint, mm.
  struct Error {
    double without = 0;  ///< where the plan wants the nut to where it would be without correction
    double left = 0;     ///< where it really is
  };
  /// One period: joints of the plan and those sent to the drives.
  void step(const JointVec& q_plan, const JointVec& q_setpoint);

  struct Report {
    int joint = 0;
    double rise_K = 0;  ///< of the warmest place, greatest so far
    Error worst;        ///< absolute values, greatest so far
  };
  const std::vector<Report>& reports() const { return reports_; }

 private:
  struct Screw {
    SimulatedScrewConfig config;
    ScrewHeatModel model;
    std::vector<double> way_mm, u_mm;
    double last_mm = 0;
    bool seen = false;
  };
  double place(const Screw& screw, double joint_mm) const;
  double displacement(const Screw& screw, double x_mm) const;
  void warm(Screw& screw);

  double period_s_, time_s_ = 0, next_s_ = 1;
  SensorBoard& board_;
  std::vector<Screw> screws_;
  std::vector<Report> reports_;
};

/// The tables [[drives.screw]] of the config; none: no screw warms up. ConfigError as ConfigTable.
std::vector<SimulatedScrewConfig> read_simulated_screws(const Machine& machine, SensorBoard& board);

}  // namespace trn
