#include "app/session/scope_ring.h"

#include "core/check.h"

namespace trn {

double* ScopeRing::push(std::uint64_t new_period) {
  TRN_CHECK(!periods_.empty());
  TRN_CHECK(size_ == 0 || new_period > period(size_ - 1));
  if (size_ < periods_.size())
    ++size_;
  else
    begin_ = (begin_ + 1) % periods_.size();
  const std::size_t at = place(size_ - 1);
  periods_[at] = new_period;
  return values_.data() + at * columns_;
}

std::size_t ScopeRing::first_from(std::uint64_t wanted) const {
  std::size_t low = 0, high = size_;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (period(middle) < wanted)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

}  // namespace trn
