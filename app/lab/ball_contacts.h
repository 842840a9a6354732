#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "compensation/actual_chain.h"
#include "compensation/fit/ball_fit.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"

namespace trn {

/// The probe that touched the ball, where the file does not say it.
struct BallProbe {
  std::optional<double> length_mm;  ///< of the tool, to the tip's end
  std::optional<double> tip_mm;     ///< diameter of the stylus' ball
};

/// Reads the contacts that examples/probing/ball_calibration.ngc leaves, or any CSV with a headline of
/// columns x_mm, y_mm, z_mm (axes of the machine at the touch, as G53 calls them), a_deg, b_deg, c_deg, and
/// perhaps length_mm and tip_mm. The joints are those of `assembly` with its corrections in the plan, but
/// those of `corrections_off`. std::runtime_error "file:line: what is wrong".
std::vector<BallContact> read_ball_contacts(const std::string& path, const Assembly& assembly,
                                            std::uint8_t corrections_off, const BallProbe& probe);

/// The machine's own knowledge of its errors; without any, the nominal machine. ConfigError if its axes do
/// not stand in a row.
ActualChain known_chain(const Machine& machine);

/// What a fit has found, as section [corrections.geometric] of a config.
std::string ball_config_section(const BallFit& fit, const Machine& machine);

}  // namespace trn
