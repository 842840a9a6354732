#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/lab/tune/tune_bode.h"
#include "app/lab/tune/tune_fit.h"
#include "core/axes.h"

namespace trn {

/// All that a tuning found.
struct TuneResult {
  TuneFit fit;
  std::optional<TuneValue> lost_motion;  ///< mm or rad
  TuneLoop loop;
};

/// A figure of the model, as the config has it.
struct TuneKey {
  std::string name;
  double value = 0, deviation = 0;
};
/// Those that are certain.
std::vector<TuneKey> tune_keys(const TuneResult& result, const Joint& joint);
/// All of it in a line.
std::string tune_line(const TuneResult& result, const Joint& joint);

/// For people: the model with its uncertainties, play, resonance and the jerk that is recommended.
std::string tune_text(const TuneResult& result, const Joint& joint);
std::string tune_json(const TuneResult& result, const Joint& joint);
/// The joint's table for the config's section [feed_forward].
std::string tune_config(const TuneResult& result, const Joint& joint);

}  // namespace trn
