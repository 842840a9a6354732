#include "app/session/scope_record.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace trn {

namespace {

constexpr std::string_view kMark = "# trunnion scope; machine ";

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> out;
  for (std::size_t at = 0;;) {
    const std::size_t comma = line.find(',', at);
    out.push_back(line.substr(at, comma - at));
    if (comma == std::string_view::npos) return out;
    at = comma + 1;
  }
}

// An empty cell is a value that nobody knew.
bool read_number(std::string_view cell, double& value) {
  value = std::numeric_limits<double>::quiet_NaN();
  if (cell.empty()) return true;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc() && end == cell.data() + cell.size();
}

ScopeRecord::Column column_of(std::string_view cell) {
  const std::size_t bracket = cell.find(" [");
  if (bracket == std::string_view::npos) return {std::string(cell), ""};
  return {std::string(cell.substr(0, bracket)),
          std::string(cell.substr(bracket + 2, cell.size() - bracket - 3))};
}

// "# trunnion scope; machine mill; period 0.001 s; trigger 1234"
void read_remark(std::string_view line, ScopeRecord& record) {
  const std::size_t period = line.find("; period "), trigger = line.find("; trigger ");
  record.machine = std::string(line.substr(kMark.size(), period - kMark.size()));
  if (period != std::string_view::npos)
    std::from_chars(line.data() + period + 9, line.data() + line.size(), record.period_s);
  if (trigger == std::string_view::npos) return;
  std::uint64_t at = 0;
  std::from_chars(line.data() + trigger + 10, line.data() + line.size(), at);
  record.trigger_period = at;
}

}  // namespace

std::uint64_t ScopeRecord::lost() const {
  return periods.empty() ? 0 : periods.back() - periods.front() + 1 - periods.size();
}

double ScopeRecord::time_s(std::size_t row) const {
  const std::uint64_t from = trigger_period.value_or(periods.front());
  return period_s * (static_cast<double>(periods[row]) - static_cast<double>(from));
}

void ScopeRecord::drop_front(std::size_t rows) {
  periods.erase(periods.begin(), periods.begin() + static_cast<std::ptrdiff_t>(rows));
  values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rows * columns.size()));
}

ScopeRecord only(const ScopeRecord& record, const std::vector<ScopeRecord::Column>& columns) {
  ScopeRecord out{record.machine, record.period_s, columns, record.periods, {}, record.trigger_period};
  std::vector<std::size_t> places;
  for (const ScopeRecord::Column& column : columns)
    for (std::size_t k = 0; k < record.columns.size(); ++k)
      if (record.columns[k].name == column.name) places.push_back(k);
  for (std::size_t row = 0; row < record.rows(); ++row)
    for (const std::size_t k : places) out.values.push_back(record.value(row, k));
  return out;
}

std::string scope_csv(const ScopeRecord& record) {
  fmt::memory_buffer out;
  const auto to = [&] { return std::back_inserter(out); };
  fmt::format_to(to(), "{}{}; period {:.12g} s", kMark, record.machine, record.period_s);
  if (record.trigger_period) fmt::format_to(to(), "; trigger {}", *record.trigger_period);
  fmt::format_to(to(), "\nt_s,period");
  for (const ScopeRecord::Column& column : record.columns)
    fmt::format_to(to(), ",{}",
                   column.unit.empty() ? column.name : fmt::format("{} [{}]", column.name, column.unit));
  for (std::size_t row = 0; row < record.rows(); ++row) {
    fmt::format_to(to(), "\n{:.9g},{}", record.time_s(row), record.periods[row]);
    for (std::size_t k = 0; k < record.columns.size(); ++k) {
      const double value = record.value(row, k);
      if (std::isnan(value))
        out.push_back(',');
      else
        fmt::format_to(to(), ",{:.12g}", value);
    }
  }
  out.push_back('\n');
  return fmt::to_string(out);
}

ScopeRecord parse_scope_csv(const std::string& text, const std::string& name) {
  ScopeRecord record;
  std::istringstream in(text);
  std::string line;
  const auto fail = [&](int number, const std::string& what) {
    return std::runtime_error(fmt::format("{}:{}: {}", name, number, what));
  };
  if (!std::getline(in, line) || line.substr(0, kMark.size()) != kMark)
    throw fail(1, fmt::format("this is no recording of a scope; it would begin with '{}'", kMark));
  read_remark(line, record);
  if (!(record.period_s > 0)) throw fail(1, "the period is missing; it would stand as '; period 0.001 s'");
  if (!std::getline(in, line)) throw fail(2, "the header is missing");
  const auto header = cells_of(line);
  if (header.size() < 3 || header[0] != "t_s" || header[1] != "period")
    throw fail(2, "the header begins with t_s,period and has a signal at least");
  for (std::size_t k = 2; k < header.size(); ++k) record.columns.push_back(column_of(header[k]));
  for (int number = 3; std::getline(in, line); ++number) {
    const auto cells = cells_of(line);
    if (cells.size() != header.size())
      throw fail(number, fmt::format("{} columns; the header has {}", cells.size(), header.size()));
    std::uint64_t period = 0;
    const char* const period_end = cells[1].data() + cells[1].size();
    if (const auto [end, error] = std::from_chars(cells[1].data(), period_end, period);
        error != std::errc() || end != period_end)
      throw fail(number, fmt::format("'{}' is no number of a period", cells[1]));
    record.periods.push_back(period);
    for (std::size_t k = 2; k < cells.size(); ++k) {
      double value = 0;
      if (!read_number(cells[k], value)) throw fail(number, fmt::format("'{}' is no number", cells[k]));
      record.values.push_back(value);
    }
  }
  return record;
}

}  // namespace trn
