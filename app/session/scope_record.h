#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trn {

/// Signals over some periods, as they were watched.
struct ScopeRecord {
  struct Column {
    std::string name, unit;
  };
  std::string machine;
  double period_s = 0;
  std::vector<Column> columns;
  std::vector<std::uint64_t> periods;
  std::vector<double> values;  ///< row by row
  std::optional<std::uint64_t> trigger_period;

  std::size_t rows() const { return periods.size(); }
  double value(std::size_t row, std::size_t column) const { return values[row * columns.size() + column]; }
  /// Periods that are missing between the first and the last one.
  std::uint64_t lost() const;
  /// s from the trigger, or from the first row if nothing triggered.
  double time_s(std::size_t row) const;
  /// Forgets the first rows.
  void drop_front(std::size_t rows);
};

/// The same rows of these columns alone, which the record has.
ScopeRecord only(const ScopeRecord& record, const std::vector<ScopeRecord::Column>& columns);

/// CSV: a remark with machine, period and trigger, then a header of `t_s`, `period` and a column for each
/// signal, its unit in brackets.
std::string scope_csv(const ScopeRecord& record);
/// The way back; std::runtime_error "file:line: what" where `text` of the file `name` is none.
ScopeRecord parse_scope_csv(const std::string& text, const std::string& name);

}  // namespace trn
