#include "app/session/make_cycle.h"

#include "app/session/signal_config.h"

namespace trn {

CycleConfig cycle_config(const Assembly& assembly, ProgramStops stops) {
  CycleConfig config;
  config.period_s = assembly.machine.period_s;
  config.joints = assembly.machine.joints;
  config.plan_joints = assembly.plan_joints;
  config.stops = stops;
  config.optional_stop = assembly.program.optional_stop;
  config.spindle_timeout_s = assembly.spindle_timeout_s;
  config.feed_forward = assembly.feed_forward;
  config.safety = assembly.safety;
  for (const NamedWire& signal : assembly.signals) config.wires.push_back(signal.wire);
  config.X_WB_idle = inverse(assembly.kinematics->home_X_BM());
  return config;
}

Cycle make_cycle(const Assembly& assembly, MotionQueue& queue, ProgramStops stops) {
  return make_cycle(assembly, queue, stops, *assembly.drives, assembly.io.get(), *assembly.rate_plans);
}

Cycle make_cycle(const Assembly& assembly, MotionQueue& queue, ProgramStops stops, Drives& drives,
                 MachineIo* io, RatePlans& plans) {
  return {
      cycle_config(assembly, stops),
      {*assembly.map, queue, drives, plans, assembly.corrections.setpoint.get(), io, assembly.spindle_axis}};
}

Cycle make_replay_cycle(const Assembly& assembly, MotionQueue& queue, ProgramStops stops, Drives& drives,
                        MachineIo* io, RatePlans& plans) {
  CycleConfig config = cycle_config(assembly, stops);
  config.safety.clear();
  config.wires.clear();
  return {config, {*assembly.map, queue, drives, plans, assembly.corrections.setpoint.get(), io}};
}

}  // namespace trn
