#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "app/session/feature_meter.h"

namespace trn {

/// Features of a program for people (the first twenty; `more` beyond them are only counted) and for programs.
std::string features_text(const std::vector<FeatureDeflection>& features, std::size_t more = 0);
nlohmann::json features_json(const std::vector<FeatureDeflection>& features);
/// The way back; throws as nlohmann::json where it is no such thing.
std::vector<FeatureDeflection> features_from(const nlohmann::json& json);

}  // namespace trn
