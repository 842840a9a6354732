#pragma once

#include <optional>
#include <string>

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

/// For people: the model with its uncertainties, play, resonance and the jerk that is recommended.
std::string tune_text(const TuneResult& result, const Joint& joint);
std::string tune_json(const TuneResult& result, const Joint& joint);
/// The joint's table for the config's section [feed_forward].
std::string tune_config(const TuneResult& result, const Joint& joint);

}  // namespace trn
