#pragma once

#include <string>

#include "app/lab/workspace.h"

namespace trn {

/// Sections through home as an SVG: tilt reached, conditioning, speeds.
std::string workspace_svg(const Workspace& workspace, const std::string& title);

}  // namespace trn
