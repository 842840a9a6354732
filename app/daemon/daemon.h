#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/daemon/door.h"
#include "app/daemon/place_keeper.h"
#include "app/daemon/program_source.h"
#include "app/daemon/rate_planner_thread.h"
#include "app/daemon/realtime.h"
#include "app/session/feature_recorder.h"
#include "app/session/realtime_config.h"
#include "app/session/scope_config.h"
#include "app/session/session_log.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"
#include "hal/lcm_link.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"
#include "kernel/tick_port.h"

namespace trn {

/// A machine put together, ready to be run in real time.
struct DaemonParts {
  const Machine& machine;
  LcmConfig lcm;
  Door& door;
  RealtimeConfig realtime;
  Drives& drives;
  TickPort& tick;
  ProgramSource& programs;
  RatePlannerThread& rate_plans;
  ReportSink* record = nullptr;
  SessionLog* log = nullptr;
  const MachineJointMap* map = nullptr;  ///< see MachineController::Parts
  const SetpointChain* chain = nullptr;
  SensorBoard* sensors = nullptr;  ///< readings of clients go there; null: nobody wants any
  std::vector<std::function<void()>> background = {};      ///< called many times a second outside the tick
  std::function<void(const CycleReport&)> on_report = {};  ///< hears of every period; may be empty
  const MachineIo* io = nullptr;                           ///< for the text of its fault; null: there is none
  FeatureRecorder* features = nullptr;     ///< see MachineController::Parts; hears of every period
  const Kinematics* kinematics = nullptr;  ///< see MachineController::Parts
  const Joints* plan_joints = nullptr;     ///< see MachineController::Parts
  std::string version = {};                ///< see MachineController::Parts
  std::string counters_file = {};          ///< see MachineController::Parts
  PlaceKeeper* place = nullptr;            ///< see MachineController::Parts
  ScopeConfig scope = {};
  std::string log_file = {};  ///< of `log`; faults are kept beside it; "": nowhere
};

/// What the daemon tells goes to stderr from now on.
void log_to_stderr();

/// Runs the machine until SIGTERM or SIGINT has ended it in good order: motion, then drives, then this
/// returns. std::runtime_error with what is wrong and how to mend it: no place for its socket, a second
/// daemon, a dead clock. Must be called before the process has other threads.
void run_daemon(const DaemonParts& parts);

}  // namespace trn
