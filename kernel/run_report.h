#pragma once

#include <string>

#include "kernel/simulation.h"

namespace trn {

/// The summary of a run for people, and for programs (mm, rad, s; degrees where a key says so).
std::string run_summary(const SimulationResult& result, const Machine& machine, const std::string& program);
std::string run_json(const SimulationResult& result, const Machine& machine, const std::string& program);

}  // namespace trn
