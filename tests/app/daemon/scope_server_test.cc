#include "app/daemon/scope_server.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/daemon/fault_keeper.h"
#include "app/session/assembly.h"
#include "app/session/scope_record.h"
#include "app/session/signals.h"
#include "core/axes.h"
#include "core/fault.h"
#include "tests/app/daemon/socket_bench.h"
#include "tests/support/paths.h"

// What the daemon hands out of its last seconds, and what it keeps of a fault.
namespace trn {
namespace {

namespace fs = std::filesystem;
using trunnion::scope_data_t;
using trunnion::scope_request_t;
using trunnion::scope_signals_t;

struct ScopeBench {
  explicit ScopeBench(const std::string& log = "", double seconds = 2) {
    config.seconds = seconds;
    config.after_fault_s = 0.1;
    config.fault_files = 3;
    server.emplace(socket.server, socket.access, names, assembly.machine, table, config, log);
    socket.client.subscribe<scope_data_t>(names.scope_data_channel(), [this](const auto& d) { data = d; });
    socket.client.subscribe<scope_signals_t>(names.scope_signals_channel(),
                                             [this](const auto& l) { list = l; });
    report.q_plan = report.q_setpoint = report.q_measured = JointVec::Zero(5);
  }
  void tick(int times) {
    for (int i = 0; i < times; ++i) {
      report.q_setpoint[0] = report.q_measured[0] = static_cast<double>(report.period);
      server->report(report);
      ++report.period;
    }
  }
  void ask(const std::vector<std::string>& signals, std::int64_t from, std::int32_t rows_max = 1'000'000) {
    scope_request_t request{};
    request.client = 7;
    request.sequence = 3;
    request.from_period = from;
    request.rows_max = rows_max;
    request.signal = signals;
    request.signal_count = static_cast<std::int32_t>(signals.size());
    data.reset();
    socket.client.publish(names.scope_request_channel(), request);
    socket.pump();
  }

  LcmConfig names{LcmConfig::kDefaultUrl, "bench"};
  SocketBench socket;
  Assembly assembly = assemble(source_dir() + "/configs/cradle_servo.toml");
  SignalTable table{assembly.machine, assembly.corrections.setpoint.get(), 2};
  ScopeConfig config;
  std::optional<ScopeServer> server;
  std::optional<scope_data_t> data;
  std::optional<scope_signals_t> list;
  CycleReport report;
};

TEST(ScopeServer, TellsItsSignals) {
  ScopeBench bench;
  bench.ask({}, 0);
  ASSERT_TRUE(bench.list);
  EXPECT_EQ(bench.list->client, 7);
  EXPECT_EQ(bench.list->sequence, 3);
  EXPECT_EQ(bench.list->name.size(), bench.table.signals().size());
  EXPECT_EQ(bench.list->name[0], "X.plan");
  EXPECT_EQ(bench.list->unit[0], "mm");
}

TEST(ScopeServer, HandsOutWhatItHasPeriodByPeriod) {
  ScopeBench bench;
  bench.ask({"X.measured"}, 0);
  ASSERT_TRUE(bench.data);
  EXPECT_EQ(bench.data->row_count, 0);
  EXPECT_EQ(bench.data->oldest_period, -1);
  bench.tick(5000);  // 2 s are 2000 periods
  bench.ask({"X.measured", "line"}, 4990);
  ASSERT_TRUE(bench.data);
  EXPECT_EQ(bench.data->message, "");
  EXPECT_EQ(bench.data->oldest_period, 3000);
  EXPECT_EQ(bench.data->newest_period, 4999);
  ASSERT_EQ(bench.data->row_count, 10);
  EXPECT_EQ(bench.data->period[9], 4999);
  EXPECT_EQ(bench.data->value[18], 4999);
  // What is older than it remembers begins with the oldest; the last ones are counted back.
  bench.ask({"X.measured"}, 5, 20);
  EXPECT_EQ(bench.data->period.front(), 3000);
  EXPECT_EQ(bench.data->row_count, 20);
  bench.ask({"X.measured"}, -3);
  EXPECT_EQ(bench.data->period, (std::vector<std::int64_t>{4997, 4998, 4999}));
}

// One after the other, whole messages at a time, nothing is missing.
TEST(ScopeServer, LosesNothingToAClientThatAsksOn) {
  ScopeBench bench("", 4);
  const std::vector<std::string> signals(ScopeServer::kSignalsMax, "X.measured");
  std::int64_t next = 0, messages = 0;
  for (int turn = 0; turn < 40; ++turn) {
    bench.tick(120);
    for (bool more = true; more; ++messages) {
      bench.ask(signals, next);
      ASSERT_TRUE(bench.data);
      for (const std::int64_t period : bench.data->period) ASSERT_EQ(period, next++);
      more = bench.data->row_count > 0 && next <= bench.data->newest_period;
    }
  }
  EXPECT_EQ(next, 40 * 120);
  EXPECT_EQ(messages, 80) << "two whole messages a turn";
}

TEST(ScopeServer, SaysWhatIsWrong) {
  ScopeBench bench;
  bench.tick(10);
  bench.ask({"X.measurd"}, 0);
  ASSERT_TRUE(bench.data);
  EXPECT_EQ(bench.data->message, "there is no signal 'X.measurd'; did you mean 'X.measured'?");
  EXPECT_EQ(bench.data->row_count, 0);
  bench.ask(std::vector<std::string>(65, "line"), 0);
  EXPECT_EQ(bench.data->message, "65 signals; 64 at a time are legal");
  bench.ask({"line"}, 0, -5);
  EXPECT_EQ(bench.data->row_count, 0);
}

std::vector<std::string> fault_files(const std::string& log) {
  std::vector<std::string> out;
  for (int i = 1; i < 10; ++i)
    if (const std::string path = log + ".fault" + std::to_string(i) + ".csv"; fs::exists(path))
      out.push_back(path);
  return out;
}

ScopeRecord read_file(const std::string& path) {
  std::ifstream in(path);
  return parse_scope_csv({std::istreambuf_iterator<char>(in), {}}, path);
}

TEST(FaultKeeper, KeepsTheSecondsAboutAFaultBesideTheLog) {
  const std::string log = testing::TempDir() + "kept.log";
  for (const std::string& path : fault_files(log)) fs::remove(path);
  {
    ScopeBench bench(log, 1);
    bench.report.words[0] = {0x1237, 0x0F};
    bench.tick(3000);
    bench.report.fault = Fault::kFollowingError;
    bench.tick(500);
  }
  ASSERT_EQ(fault_files(log).size(), 1u);
  const ScopeRecord record = read_file(fault_files(log)[0]);
  EXPECT_EQ(record.trigger_period, 3000u);
  EXPECT_EQ(record.periods.back(), 3100u);
  EXPECT_EQ(record.rows(), 1000u);
  EXPECT_EQ(record.lost(), 0u);
  // Switches that stayed off and what nobody knew are left out.
  for (const ScopeRecord::Column& column : record.columns) {
    EXPECT_EQ(column.name.find("input."), std::string::npos) << column.name;
    EXPECT_NE(column.name, "X.current");
  }
}

bool has_record(const std::string& log, std::uint64_t trigger) {
  const auto files = fault_files(log);
  return std::any_of(files.begin(), files.end(),
                     [&](const std::string& file) { return read_file(file).trigger_period == trigger; });
}

TEST(FaultKeeper, KeepsOneFileAFaultAndSoManyOfThem) {
  const std::string log = testing::TempDir() + "many.log";
  for (const std::string& path : fault_files(log)) fs::remove(path);
  {
    ScopeBench bench(log, 1);
    for (int i = 0; i < 5; ++i) {
      bench.report.fault = Fault::kOk;
      bench.tick(200);
      const std::uint64_t trigger = bench.report.period;
      bench.report.fault = Fault::kFollowingError;
      bench.tick(200);
      for (int waits = 0; waits < 30000 && !has_record(log, trigger); ++waits)  // a busy disk takes its time
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  ASSERT_EQ(fault_files(log).size(), 3u);
  std::vector<std::uint64_t> triggers;
  for (const std::string& path : fault_files(log)) triggers.push_back(*read_file(path).trigger_period);
  std::sort(triggers.begin(), triggers.end());
  EXPECT_EQ(triggers, (std::vector<std::uint64_t>{1000, 1400, 1800}));
}

// Fault upon fault, faster than files can be written: they take the memory of one, and what is written is
// whole.
TEST(FaultKeeper, ADiskThatIsSlowDoesNotFillTheMemory) {
  const std::string log = testing::TempDir() + "slow.log";
  for (const std::string& path : fault_files(log)) fs::remove(path);
  const auto allocated = [] {
    const struct mallinfo2 memory = mallinfo2();
    return static_cast<double>(memory.uordblks + memory.hblkhd);
  };
  {
    ScopeBench bench(log, 1);
    bench.tick(1000);
    const double before = allocated();
    const double ring = static_cast<double>(bench.table.signals().size()) * 1000 * sizeof(double);
    for (int i = 0; i < 100; ++i) {
      bench.report.fault = Fault::kOk;
      bench.tick(50);
      bench.report.fault = Fault::kFollowingError;
      bench.tick(101);
      EXPECT_LT(allocated(), before + 12 * ring) << "fault " << i;
    }
  }
  const auto files = fault_files(log);
  ASSERT_FALSE(files.empty());
  for (const std::string& path : files) {
    const ScopeRecord record = read_file(path);
    EXPECT_EQ(std::count(record.periods.begin(), record.periods.end(), *record.trigger_period), 1) << path;
  }
}

TEST(FaultKeeper, KeepsNothingWithoutALog) {
  ScopeBench bench("", 1);
  bench.report.fault = Fault::kFollowingError;
  bench.tick(500);  // and nothing fails
}

// What a period costs the thread that hands out reports.
TEST(ScopeServer, TakesLittleOfAPeriod) {
  ScopeBench bench("", 10);
  bench.tick(10'000);
  const auto begin = std::chrono::steady_clock::now();
  bench.tick(100'000);
  const double us =
      1e-5 * std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
  std::printf("    %.2f us a period for %zu columns\n", us, bench.table.columns());
  EXPECT_LT(us, 50);
}

}  // namespace
}  // namespace trn
