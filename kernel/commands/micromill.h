#pragma once

#include "kernel/commands/commands.h"

namespace trn {

/// micromill train, stiffness, sweep, experiment
void add_micromill(CLI::App& app, Exit& exit);

}  // namespace trn
