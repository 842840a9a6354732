#pragma once

#include <nlohmann/json.hpp>

#include "interp/gcode/measured_values.h"

namespace trn {

/// The whole of it, and back to the bit. std::exception where it is no such thing.
nlohmann::json measured_json(const MeasuredValues& measured);
MeasuredValues measured_from(const nlohmann::json& json);

}  // namespace trn
