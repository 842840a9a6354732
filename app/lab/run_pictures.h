#pragma once

#include <string>

#include "app/check/deviation_meter.h"
#include "app/lab/run_recorder.h"
#include "app/session/simulation.h"
#include "core/machine.h"

namespace trn {

/// Pictures of a run, SVG: speed, acceleration and jerk of the tip over time, coloured by the joint that is
/// at a limit.
std::string speed_picture(const Machine& machine, const std::vector<RunBin>& bins);
/// Share of the limits that each joint uses over time, and how long it stands at which.
std::string joint_picture(const Machine& machine, const std::vector<RunBin>& bins,
                          const SimulationResult& result);
/// The tip's way in the work, seen along Z and along Y, coloured by speed.
std::string path_picture(const std::vector<RunBin>& bins);
/// How often the tip and the axis were how far off, as a share of the tolerance.
std::string deviation_picture(const DeviationReport& report);

/// Writes them into the folder, which is made where it is missing, and report.html, which holds them all and
/// needs nothing else. OutputError when something cannot be written.
void write_run_pictures(const std::string& folder, const std::string& program, const Machine& machine,
                        const std::vector<RunBin>& bins, const SimulationResult& result);

}  // namespace trn
