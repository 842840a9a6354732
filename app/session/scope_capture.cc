#include "app/session/scope_capture.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trn {

ScopeCapture::ScopeCapture(const ScopeWish& wish, ScopeRecord columns)
    : wish_(wish), record_(std::move(columns)) {
  if (wish_.trigger) watch_.emplace(*wish_.trigger);
}

std::uint64_t ScopeCapture::periods_of(double seconds) const {
  return static_cast<std::uint64_t>(std::llround(seconds / record_.period_s));
}

void ScopeCapture::take(std::uint64_t period, const double* values, bool old) {
  if (done()) return;
  const std::size_t columns = record_.columns.size();
  record_.periods.push_back(period);
  record_.values.insert(record_.values.end(), values, values + columns);
  // The watch sees old rows, too: an edge needs the value before it.
  const bool fires = watch_ ? watch_->fires(values[columns]) : !wish_.rolling;
  if (fires && !old && !triggered()) record_.trigger_period = period;
  // Rows that nobody will want go in batches, since the front of a list is dear.
  const std::uint64_t kept = periods_of(wish_.rolling ? wish_.seconds : wish_.before_s);
  if ((!triggered() || wish_.rolling) && record_.rows() > 2 * kept + 1000)
    forget_before(period - std::min(period, kept));
}

void ScopeCapture::forget_before(std::uint64_t period) {
  const auto first = std::lower_bound(record_.periods.begin(), record_.periods.end(), period);
  record_.drop_front(static_cast<std::size_t>(first - record_.periods.begin()));
}

bool ScopeCapture::done() const {
  if (wish_.rolling || !triggered() || record_.periods.empty()) return false;
  return record_.periods.back() + 1 >= *record_.trigger_period + periods_of(wish_.seconds);
}

const ScopeRecord& ScopeCapture::record() {
  if (record_.periods.empty()) return record_;
  const std::uint64_t end = wish_.rolling ? record_.periods.back() + 1 : record_.trigger_period.value_or(0);
  const std::uint64_t kept = periods_of(wish_.rolling ? wish_.seconds : wish_.before_s);
  forget_before(end - std::min(end, kept));
  return record_;
}

}  // namespace trn
