#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/session/scope_capture.h"
#include "app/session/scope_record.h"
#include "app/session/scope_ring.h"
#include "app/session/scope_trigger.h"

// What a scope keeps, when it triggers, and the table that it writes.
namespace trn {
namespace {

TEST(ScopeRing, KeepsTheNewestRows) {
  ScopeRing ring(2, 4);
  EXPECT_EQ(ring.size(), 0u);
  EXPECT_EQ(ring.first_from(0), 0u);
  for (std::uint64_t period : {5u, 6u, 7u, 9u, 10u, 11u}) {
    double* row = ring.push(period);
    row[0] = static_cast<double>(period);
    row[1] = -row[0];
  }
  ASSERT_EQ(ring.size(), 4u);
  EXPECT_EQ(ring.period(0), 7u);
  EXPECT_EQ(ring.period(3), 11u);
  EXPECT_EQ(ring.row(1)[1], -9);
  EXPECT_EQ(ring.first_from(0), 0u);
  EXPECT_EQ(ring.first_from(8), 1u);
  EXPECT_EQ(ring.first_from(11), 3u);
  EXPECT_EQ(ring.first_from(12), 4u);
}

std::vector<int> fires_at(const std::string& text, const std::vector<double>& values) {
  TriggerWatch watch(parse_trigger(text));
  std::vector<int> out;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (watch.fires(values[i])) out.push_back(static_cast<int>(i));
  return out;
}

TEST(ScopeTrigger, FiresOnEdgesLevelsFaultsAndLines) {
  const std::vector<double> wave = {0, 4, 6, 7, 3, 5, 9};
  EXPECT_EQ(fires_at("rising X.force 5", wave), (std::vector<int>{2, 5}));
  EXPECT_EQ(fires_at("falling X.force 5", wave), (std::vector<int>{4}));
  EXPECT_EQ(fires_at("above X.force 5", wave), (std::vector<int>{2, 3, 6}));
  EXPECT_EQ(fires_at("below X.force 4", wave), (std::vector<int>{0, 4}));
  EXPECT_EQ(fires_at("line 7", {0, 6, 7, 7, 8, 7}), (std::vector<int>{2, 5}));
  EXPECT_EQ(fires_at("fault", {0, 0, 12, 12, 0, 3}), (std::vector<int>{2, 5}));
  // A value that nobody knows is no edge.
  EXPECT_EQ(fires_at("rising X.force 5", {0, std::nan(""), 6}), (std::vector<int>{2}));
  EXPECT_EQ(parse_trigger("fault").signal, "fault");
  EXPECT_EQ(parse_trigger("line 12").signal, "line");
}

TEST(ScopeTrigger, RefusesWhatIsNone) {
  for (const char* text :
       {"", "X.force", "rising X.force", "rising X.force five", "line", "line 0", "fault 3 4 5"})
    EXPECT_THROW(parse_trigger(text), std::invalid_argument) << text;
}

ScopeRecord columns() {
  ScopeRecord record;
  record.machine = "mill";
  record.period_s = 0.001;
  record.columns = {{"X.measured", "mm"}, {"line", ""}};
  return record;
}

/// Rows of the periods from `first` on; the third value is the trigger's: the period itself.
void feed(ScopeCapture& capture, std::uint64_t first, std::uint64_t end, std::uint64_t old_up_to = 0) {
  for (std::uint64_t period = first; period < end; ++period) {
    const auto p = static_cast<double>(period);
    const double row[] = {p / 2, p, p};
    capture.take(period, row, period <= old_up_to);
  }
}

TEST(ScopeCapture, WithoutATriggerBeginsWithTheFirstRow) {
  ScopeCapture capture({0.1, 0, std::nullopt, false}, columns());
  feed(capture, 1000, 2000);
  EXPECT_TRUE(capture.done());
  const ScopeRecord& record = capture.record();
  EXPECT_EQ(record.rows(), 100u);
  EXPECT_EQ(record.periods.front(), 1000u);
  EXPECT_EQ(record.value(99, 0), 1099 / 2.0);
}

TEST(ScopeCapture, KeepsWhatWasBeforeTheTrigger) {
  ScopeCapture capture({0.1, 0.05, parse_trigger("rising X.measured 50000"), false}, columns());
  feed(capture, 10, 50'000);
  EXPECT_FALSE(capture.triggered());
  feed(capture, 50'000, 50'099);
  EXPECT_TRUE(capture.triggered());
  EXPECT_FALSE(capture.done());
  feed(capture, 50'099, 60'000);
  EXPECT_TRUE(capture.done());
  const ScopeRecord& record = capture.record();
  EXPECT_EQ(record.periods.front(), 49'950u);
  EXPECT_EQ(record.periods.back(), 50'099u);
  EXPECT_EQ(record.trigger_period, 50'000u);
  EXPECT_EQ(record.lost(), 0u);
  EXPECT_NEAR(record.time_s(0), -0.05, 1e-12);
}

// What was before the scope began shows its past and triggers nothing.
TEST(ScopeCapture, OldRowsTriggerNothing) {
  ScopeCapture capture({0.01, 0.02, parse_trigger("above X.measured 100"), false}, columns());
  feed(capture, 80, 120, 119);
  EXPECT_FALSE(capture.triggered());
  feed(capture, 120, 200);
  const ScopeRecord& record = capture.record();
  EXPECT_EQ(record.trigger_period, 120u);
  EXPECT_EQ(record.periods.front(), 100u);
}

TEST(ScopeCapture, RollsInBoundedMemory) {
  ScopeCapture capture({0.1, 0, std::nullopt, true}, columns());
  feed(capture, 0, 1'000'000);
  EXPECT_FALSE(capture.done());
  EXPECT_EQ(capture.record().rows(), 100u);
  EXPECT_EQ(capture.record().periods.back(), 999'999u);
}

TEST(ScopeRecord, CountsWhatIsLost) {
  ScopeCapture capture({0.1, 0, std::nullopt, false}, columns());
  feed(capture, 1000, 1040);
  feed(capture, 1043, 1200);
  EXPECT_EQ(capture.record().lost(), 3u);
}

TEST(ScopeRecord, ComesBackFromItsTable) {
  ScopeCapture capture({0.1, 0.01, parse_trigger("rising X.measured 100"), false}, columns());
  feed(capture, 50, 300);
  const ScopeRecord record = capture.record();
  ScopeRecord made = record;
  made.values[3] = std::nan("");
  made.values[4] = 1.0 / 3;
  const ScopeRecord again = parse_scope_csv(scope_csv(made), "x.csv");
  EXPECT_EQ(again.machine, "mill");
  EXPECT_EQ(again.period_s, 0.001);
  EXPECT_EQ(again.trigger_period, 100u);
  EXPECT_EQ(again.periods, record.periods);
  ASSERT_EQ(again.columns.size(), 2u);
  EXPECT_EQ(again.columns[0].name, "X.measured");
  EXPECT_EQ(again.columns[0].unit, "mm");
  EXPECT_EQ(again.columns[1].unit, "");
  EXPECT_TRUE(std::isnan(again.values[3]));
  EXPECT_NEAR(again.values[4], 1.0 / 3, 1e-11);
  EXPECT_EQ(only(again, {{"line", ""}}).values[2], record.values[5]);
}

// Whole seconds, the daemon's millisecond, and a period as short as 16 kHz.
TEST(ScopeRecord, KeepsThePeriodOfAnyMachine) {
  for (const double period_s : {2.0, 0.001, 0.0000625, 1e-9}) {
    ScopeRecord record = columns();
    record.period_s = period_s;
    record.periods = {7, 9};
    record.values = {1, 2, 3, 4};
    const ScopeRecord again = parse_scope_csv(scope_csv(record), "x.csv");
    EXPECT_DOUBLE_EQ(again.period_s, period_s);
    EXPECT_FALSE(again.trigger_period);
    EXPECT_DOUBLE_EQ(again.time_s(1), 2 * period_s) << "from the first row";
    EXPECT_EQ(again.values, record.values);
  }
}

TEST(ScopeRecord, RefusesOtherTables) {
  const auto error_of = [](const std::string& text) {
    try {
      parse_scope_csv(text, "x.csv");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(error_of("t_s,X\n").substr(0, 9), "x.csv:1: ");
  const std::string head = "# trunnion scope; machine mill; period 0.001 s\n";
  EXPECT_EQ(error_of(head + "t,X\n").substr(0, 9), "x.csv:2: ");
  EXPECT_EQ(error_of(head + "t_s,period,X [mm]\n0,1\n"), "x.csv:3: 2 columns; the header has 3");
  EXPECT_EQ(error_of(head + "t_s,period,X [mm]\n0,1,three\n"), "x.csv:3: 'three' is no number");
  EXPECT_EQ(error_of(head + "t_s,period,X [mm]\n0,one,1\n"), "x.csv:3: 'one' is no number of a period");
  EXPECT_EQ(error_of("# trunnion scope; machine mill\nt_s,period,X\n").substr(0, 31),
            "x.csv:1: the period is missing;");
}

}  // namespace
}  // namespace trn
