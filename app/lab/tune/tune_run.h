#pragma once

#include <functional>

#include "app/lab/tune/tune_data.h"
#include "app/lab/tune/tune_plan.h"
#include "app/session/assembly.h"

namespace trn {

/// Moves the joint of an emulated machine in this process by the plan, without feed-forward, and returns what
/// it did. `plan_of` makes the plan for where the joint stands. std::runtime_error where the machine does not
/// get ready or faults.
TuneData tune_emulated(Assembly& assembly, int joint, const std::function<TunePlan(double stands)>& plan_of);

}  // namespace trn
