#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trn {

/// The last rows of all signals, of a fixed number of periods; its memory is taken at once.
class ScopeRing {
 public:
  ScopeRing(std::size_t columns, std::size_t rows)
      : columns_(columns), periods_(rows), values_(rows * columns) {}

  /// Room for the newest row, in place of the oldest. Periods only grow; some may be missing.
  double* push(std::uint64_t period);

  std::size_t size() const { return size_; }
  std::size_t columns() const { return columns_; }
  /// Rows count from the oldest, 0.
  std::uint64_t period(std::size_t row) const { return periods_[place(row)]; }
  const double* row(std::size_t row) const { return values_.data() + place(row) * columns_; }
  /// The first row of this period or a later one; size() if there is none.
  std::size_t first_from(std::uint64_t period) const;

 private:
  std::size_t place(std::size_t row) const { return (begin_ + row) % periods_.size(); }

  std::size_t columns_, begin_ = 0, size_ = 0;
  std::vector<std::uint64_t> periods_;
  std::vector<double> values_;
};

}  // namespace trn
