#pragma once

#include "app/cli/commands.h"

namespace trn {

/// micromill train, stiffness, sweep, experiment
void add_micromill(CLI::App& app, Exit& exit);

}  // namespace trn
