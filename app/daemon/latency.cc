#include "app/daemon/latency.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/check.h"

namespace trn {

namespace {
constexpr std::array kPeriodsUs = {250.0, 500.0, 1000.0, 2000.0, 4000.0};
}  // namespace

std::string_view to_string(PeriodFit fit) {
  static constexpr std::string_view kNames[] = {"good", "tight", "no"};
  return kNames[static_cast<std::size_t>(fit)];
}

std::vector<PeriodVerdict> judge_periods(double latest_us, double longest_us) {
  TRN_CHECK(latest_us >= 0 && longest_us >= 0);
  const double taken_us = latest_us + longest_us;
  std::vector<PeriodVerdict> out;
  for (const double period_us : kPeriodsUs) {
    const PeriodFit fit = taken_us <= period_us / 2 ? PeriodFit::kGood
                          : taken_us < period_us    ? PeriodFit::kTight
                                                    : PeriodFit::kNo;
    out.push_back({period_us, fit});
  }
  return out;
}

double shortest_good_us(const std::vector<PeriodVerdict>& verdicts) {
  const auto found = std::find_if(verdicts.begin(), verdicts.end(), [](const PeriodVerdict& verdict) {
    return verdict.fit == PeriodFit::kGood;
  });
  return found == verdicts.end() ? 0 : found->period_us;
}

}  // namespace trn
