#include "app/lab/scope_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lab/picture/axes.h"
#include "app/lab/picture/colours.h"
#include "app/lab/picture/svg.h"
#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"
#include "hal/message_codec.h"

namespace trn {

namespace {

using picture::Axes;
using picture::Box;
using picture::Px;
using picture::Svg;

constexpr double kScopeWidth = 1000, kScopeLeft = 80, kScopeRight = 20, kScopePanel = 170, kScopeGap = 62,
                 kScopeTop = 84, kScopeMargin = 0.06;
constexpr std::size_t kRowsAMessage = 100;
constexpr std::uint32_t kEventMark = 0xEDA1DA01;  // of an event in a log of LCM

/// Columns of one unit; numbers without one stand each in a panel of their own, and errors, which are small,
/// apart from places.
struct ScopePanelOf {
  std::string label;
  std::vector<std::size_t> columns;
};

std::string panel_label(const ScopeRecord::Column& column) {
  if (column.unit.empty()) return column.name;
  const bool error = column.name.find(".following_error") != std::string::npos;
  return error ? "following error, " + column.unit : column.unit;
}

std::vector<ScopePanelOf> panels_of(const ScopeRecord& record) {
  std::vector<ScopePanelOf> panels;
  for (std::size_t k = 0; k < record.columns.size(); ++k) {
    const std::string label = panel_label(record.columns[k]);
    const auto found = std::find_if(panels.begin(), panels.end(),
                                    [&](const ScopePanelOf& panel) { return panel.label == label; });
    if (found == panels.end())
      panels.push_back({label, {k}});
    else
      found->columns.push_back(k);
  }
  return panels;
}

void draw_panel(Svg& svg, const ScopeRecord& record, const ScopePanelOf& panel, double top, bool last) {
  std::vector<double> values;
  for (const std::size_t k : panel.columns)
    for (std::size_t row = 0; row < record.rows(); ++row) values.push_back(record.value(row, k));
  const double first_s = record.time_s(0),
               last_s = std::max(record.time_s(record.rows() - 1), first_s + 1e-9);
  const Axes axes({kScopeLeft, top, kScopeWidth - kScopeLeft - kScopeRight, kScopePanel}, {first_s, last_s},
                  picture::Range::over(values, kScopeMargin));
  axes.draw(svg, last ? "time, s" : "", panel.label);
  std::vector<picture::LegendEntry> legend;
  for (const std::size_t k : panel.columns) {
    const char* const colour = picture::line_colour(legend.size());
    legend.push_back({record.columns[k].name, colour});
    std::vector<Px> points;
    for (std::size_t row = 0; row < record.rows(); ++row)
      points.push_back(axes.at(record.time_s(row), record.value(row, k)));
    svg.polyline(points, colour);
  }
  if (record.trigger_period && first_s < 0)
    svg.line({axes.at(0, 0).x, top}, {axes.at(0, 0).x, top + kScopePanel}, picture::kInk);
  picture::draw_legend(svg, kScopeLeft + 160, top - 8, kScopeWidth - kScopeRight, legend);
}

void put_big_endian(std::vector<std::uint8_t>& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

trunnion::scope_data_t message_of(const ScopeRecord& record, std::size_t first) {
  trunnion::scope_data_t data{};
  data.period_s = record.period_s;
  data.oldest_period = static_cast<std::int64_t>(record.periods.front());
  data.newest_period = static_cast<std::int64_t>(record.periods.back());
  for (std::size_t row = first; row < std::min(first + kRowsAMessage, record.rows()); ++row) {
    data.period.push_back(static_cast<std::int64_t>(record.periods[row]));
    for (std::size_t k = 0; k < record.columns.size(); ++k) data.value.push_back(record.value(row, k));
  }
  data.row_count = static_cast<std::int32_t>(data.period.size());
  data.value_count = static_cast<std::int32_t>(data.value.size());
  return data;
}

trunnion::scope_signals_t names_of(const ScopeRecord& record) {
  trunnion::scope_signals_t list{};
  list.period_s = record.period_s;
  list.count = static_cast<std::int32_t>(record.columns.size());
  for (const ScopeRecord::Column& column : record.columns) {
    list.name.push_back(column.name);
    list.unit.push_back(column.unit);
    list.meaning.emplace_back();
  }
  return list;
}

/// Events of LCM's log file: mark, number, time, lengths, channel, payload; all big-endian.
class EventLog {
 public:
  template <typename Message>
  void add(std::int64_t unix_us, const std::string& channel, const Message& message) {
    const std::vector<std::uint8_t> payload = encode_inner(message);
    put_big_endian(bytes_, kEventMark, 4);
    put_big_endian(bytes_, number_++, 8);
    put_big_endian(bytes_, static_cast<std::uint64_t>(unix_us), 8);
    put_big_endian(bytes_, channel.size(), 4);
    put_big_endian(bytes_, payload.size(), 4);
    bytes_.insert(bytes_.end(), channel.begin(), channel.end());
    bytes_.insert(bytes_.end(), payload.begin(), payload.end());
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
  std::uint64_t number_ = 0;
};

}  // namespace

std::string scope_svg(const ScopeRecord& record) {
  const std::vector<ScopePanelOf> panels = panels_of(record);
  const auto count = static_cast<double>(panels.size());
  Svg svg(kScopeWidth, kScopeTop + count * (kScopePanel + kScopeGap));
  const std::string title =
      fmt::format("Scope of {}, {} periods of {:g} ms{}", record.machine, record.rows(),
                  1000 * record.period_s, record.lost() > 0 ? fmt::format(", {} lost", record.lost()) : "");
  svg.text(kScopeLeft, 30, title, {.size = 17});
  if (record.rows() == 0) return svg.str();
  for (std::size_t i = 0; i < panels.size(); ++i)
    draw_panel(svg, record, panels[i], kScopeTop + static_cast<double>(i) * (kScopePanel + kScopeGap),
               i + 1 == panels.size());
  return svg.str();
}

std::vector<std::uint8_t> scope_lcm_log(const ScopeRecord& record, std::int64_t first_unix_us) {
  EventLog log;
  LcmConfig names;
  names.machine = record.machine;
  log.add(first_unix_us, names.scope_signals_channel(), names_of(record));
  for (std::size_t row = 0; row < record.rows(); row += kRowsAMessage) {
    const double since_s = record.time_s(row) - record.time_s(0);
    log.add(first_unix_us + std::llround(1e6 * since_s), names.scope_data_channel(), message_of(record, row));
  }
  return log.take();
}

}  // namespace trn
