#pragma once

#include <string_view>
#include <vector>

namespace trn {

/// How well a host keeps a period.
enum class PeriodFit {
  kGood,   ///< wake-up and tick together took half of it at most
  kTight,  ///< they took less than the whole: other work may make it late
  kNo,     ///< some period would have been overrun
};
std::string_view to_string(PeriodFit fit);

struct PeriodVerdict {
  double period_us = 0;
  PeriodFit fit = PeriodFit::kNo;
};

/// For 250 us to 4 ms, from the latest wake-up and the longest tick that were seen, us. What was not seen in
/// the time of a measurement may still come: measure for as long as a shift, under the load of one.
std::vector<PeriodVerdict> judge_periods(double latest_us, double longest_us);

/// The shortest period that fits well; 0: none of them.
double shortest_good_us(const std::vector<PeriodVerdict>& verdicts);

}  // namespace trn
