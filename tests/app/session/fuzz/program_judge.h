#pragma once

#include <cstdint>
#include <string>

#include "app/session/operator_script.h"
#include "app/session/simulation.h"
#include "tests/app/session/fuzz/program_generator.h"

// Runs a program through the whole kernel on simulated drives, and holds what came out to the promises.
namespace trn::fuzz {

/// What was found in a run; an empty `kind`: nothing.
struct Finding {
  std::string kind;      ///< one word that stays the same while the program is made smaller
  std::string detail;    ///< figures, for people
  bool refused = false;  ///< the program was refused with a message, and nothing moved
};

/// How a program is driven.
struct Driving {
  std::vector<OperatorAction> script;
  bool single_block = false;
  bool as_programmed() const { return script.empty() && !single_block; }
};

/// Runs `program` on a fresh machine of this config. Judged: joint limits at every period (LimitJudge),
/// deviation from the programmed path (DeviationMeter), stops that the program did not ask for, where the
/// motion ends, that it takes no longer than a machine that stops after every move would, and no less time
/// than dwells and inverse time ask for.
Finding judge(const std::string& config, const Program& program, const Driving& driving);

/// Fewer lines with the same kind of finding; `runs_max` programs are tried.
Program shrink(const std::string& config, const Program& program, const Driving& driving,
               const Finding& finding, int runs_max);

}  // namespace trn::fuzz
