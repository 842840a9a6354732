#pragma once

#include <string>

#include "app/lab/plan_preview.h"
#include "core/machine.h"

namespace trn {

/// Writes FOLDER/path.html: the program's path in three dimensions, with the parts of the operator's page,
/// working from a file. False where the page was not installed with this program. std::runtime_error if the
/// file cannot be written.
bool write_run_page(const std::string& folder, const std::string& program, const Machine& machine,
                    const PlanPreview& plan);

}  // namespace trn
