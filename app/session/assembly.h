#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/client/access_config.h"
#include "app/client/gateway_config.h"
#include "app/session/corrections.h"
#include "app/session/make_drives.h"
#include "app/session/make_io.h"
#include "app/session/realtime_config.h"
#include "app/session/scope_config.h"
#include "app/session/signal_config.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/joint_model.h"
#include "core/machine.h"
#include "core/ports.h"
#include "hal/lcm_link.h"
#include "interp/gcode/program_config.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/speed/speed_planner.h"
#include "kernel/joint_map.h"
#include "kernel/rate_plans.h"
#include "kernel/safety_inputs.h"
#include "kernel/spindle_axis.h"
#include "sim/simulated_screws.h"

namespace trn {

/// Section [planner]; it may be missing.
struct PlannerConfig {
  GeometryOptions geometry;       ///< key `compress`
  SpeedOptions speed;             ///< keys `acceleration_share`, `jerk_share`
  double tolerance_mm_max = 1.0;  ///< key `tolerance_mm_max`: a larger G64 P is an error
  double buffer_s =
      1.0;  ///< key `buffer_s`: motion planned ahead of the tick, at the least; four holds at least
  long memory_mb = 1024;  ///< key `memory_mb`: what the daemon's process that plans programs may use
};
PlannerConfig read_planner(const ConfigTable& root);

/// A machine put together from its config; every key of the file is known to somebody.
struct Assembly {
  Machine machine;
  std::unique_ptr<Kinematics> kinematics;
  Corrections corrections;
  Joints plan_joints;  ///< limits less what the corrections keep for themselves
  std::unique_ptr<MachineJointMap> map;
  std::unique_ptr<RatePlans> rate_plans;  ///< made in the tick's own thread
  ProgramConfig program;
  PlannerConfig planner;
  RealtimeConfig realtime;
  LcmConfig lcm;
  AccessConfig access;
  GatewayConfig gateway;
  std::unique_ptr<Drives> drives;
  std::unique_ptr<SimulatedScrews> screws;  ///< null: no screw of the simulated machine warms up
  std::unique_ptr<MachineIo> io;            ///< null: no section [io]
  double spindle_timeout_s = 10;            ///< key `io.spindle_timeout_s`
  ScopeConfig scope = {};
  std::optional<FeedForwardConfig> feed_forward = std::nullopt;  ///< none: no section [feed_forward]
  std::vector<SafetyInputs::Input> safety = {};                  ///< section [safety]
  std::vector<NamedWire> signals = {};                           ///< tables [[signal]]
  SpindleAxis* spindle_axis = nullptr;  ///< it is `io`; null: no section [spindle_axis]
};

/// `field`: drives on a field bus are real, or emulated in this process. ConfigError with file, line and
/// column.
Assembly assemble(const std::string& config_path, Field field = Field::kEmulated);
/// The same of a config that has been read already: its root table.
Assembly assemble(const ConfigTable& config, Field field = Field::kEmulated);

/// What plans programs of a machine, and no more: neither drives nor inputs, outputs and rate plans. For a
/// config that `assemble` takes as well: keys that nothing here reads are not judged.
Assembly assemble_planning(const ConfigTable& config);

/// Where the joints of a machine stand that has not moved yet (mm, rad): one exchange with its drives, which
/// are told to stay at zero.
JointVec standing_joints(const Assembly& assembly);

/// Another period: for a denser look at the same motion.
void set_period(Assembly& assembly, double period_s);

}  // namespace trn
