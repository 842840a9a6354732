#pragma once

#include <string>

#include "app/session/simulation.h"
#include "core/machine.h"

namespace trn {

/// The summary of a run for people, and for programs (mm, rad, s; degrees where a key says so).
std::string run_summary(const SimulationResult& result, const Machine& machine, const std::string& program);
/// What was run, how long it took, and what limits it most, in sentences for people.
std::string run_sentence(const SimulationResult& result, const Machine& machine, const std::string& program);
/// What was promised and not kept, a line each: a joint's limit, the tolerance of tip or axis; "" if nothing.
std::string broken_promises(const SimulationResult& result, const Machine& machine);
std::string run_json(const SimulationResult& result, const Machine& machine, const std::string& program);

}  // namespace trn
