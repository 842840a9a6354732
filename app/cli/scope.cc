#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "app/cli/client_line.h"
#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/client/access_config.h"
#include "app/client/scope_client.h"
#include "app/lab/scope_files.h"
#include "app/lab/text_file.h"
#include "app/session/scope_capture.h"
#include "app/session/scope_record.h"
#include "app/session/scope_trigger.h"
#include "core/machine.h"
#include "core/plain_file.h"
#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"

namespace trn {

namespace {

constexpr auto kPause = std::chrono::milliseconds(100);
constexpr auto kRedraw = std::chrono::seconds(1);

struct ScopeOptions {
  std::vector<std::string> signals;
  std::string machine, trigger, csv, svg, lcm, read;
  double timeout_s = kTimeout_s, seconds = 1, before_s = 0, patience_s = 3600;
  bool list = false, rolling = false, json = false;
};

constexpr const char kScopeFooter[] =
    "Examples:\n"
    "  trunnion scope --list\n"
    "  trunnion scope X.setpoint X.measured X.following_error --seconds 2 --svg x.svg\n"
    "  trunnion scope '*.force' line --trigger 'line 120' --before 0.2 --csv cut.csv\n"
    "  trunnion scope '*.following_error' --trigger fault --before 5 --svg fault.svg\n"
    "  trunnion scope --read session.log.fault1.csv X.measured X.force --svg fault.svg\n"
    "Triggers: 'rising SIGNAL LEVEL', 'falling SIGNAL LEVEL', 'above SIGNAL LEVEL', 'below SIGNAL LEVEL', "
    "'fault',\n'line NUMBER'. The daemon keeps the last seconds of all signals ([scope] seconds), so that "
    "what "
    "was before\nthe trigger is there. Whoever may look may use it; the machine does not notice.\n"
    "Exit codes: 0 done, 2 no recording, 3 bad config, 4 no daemon or no trigger came, 5 usage.";

volatile std::sig_atomic_t scope_interrupted = 0;

/// Ctrl-C ends a recording, and what there is of it is written.
class InterruptGuard {
 public:
  InterruptGuard() : before_(std::signal(SIGINT, [](int) { scope_interrupted = 1; })) {}
  ~InterruptGuard() { std::signal(SIGINT, before_); }
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  void (*before_)(int);
};

bool matches(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  const std::string_view head = pattern.substr(0, star), tail = pattern.substr(star + 1);
  return name.size() >= head.size() + tail.size() && name.substr(0, head.size()) == head &&
         name.substr(name.size() - tail.size()) == tail;
}

/// The columns that the words of the command line stand for, in their order.
std::vector<ScopeRecord::Column> chosen(const std::vector<std::string>& words,
                                        const std::vector<ScopeRecord::Column>& all) {
  std::vector<ScopeRecord::Column> out;
  for (const std::string& word : words) {
    const std::size_t before = out.size();
    for (const ScopeRecord::Column& column : all)
      if (matches(word, column.name)) out.push_back(column);
    if (out.size() == before)
      throw CLI::ValidationError(
          "SIGNAL", fmt::format("there is no signal '{}'; 'trunnion scope --list' tells them", word));
  }
  return out;
}

std::vector<ScopeRecord::Column> columns_of(const trunnion::scope_signals_t& list) {
  std::vector<ScopeRecord::Column> out;
  for (std::size_t i = 0; i < list.name.size(); ++i) out.push_back({list.name[i], list.unit[i]});
  return out;
}

Exit show_list(ScopeClient& client, bool json) {
  const trunnion::scope_signals_t list = client.signals();
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < list.name.size(); ++i) {
    rows.push_back({{"name", list.name[i]}, {"unit", list.unit[i]}, {"meaning", list.meaning[i]}});
    if (!json) fmt::print("{:<24} {:<9} {}\n", list.name[i], list.unit[i], list.meaning[i]);
  }
  if (json) fmt::print("{}\n", rows.dump());
  return Exit::kDone;
}

std::int64_t scope_unix_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void write_files(const ScopeOptions& options, const ScopeRecord& record) {
  if (!options.csv.empty()) write_text_file(options.csv, scope_csv(record));
  if (!options.svg.empty()) write_text_file(options.svg, scope_svg(record));
  if (options.lcm.empty() || record.rows() == 0) return;
  const double length_s = record.time_s(record.rows() - 1) - record.time_s(0);
  const auto bytes = scope_lcm_log(record, scope_unix_us() - std::llround(1e6 * length_s));
  write_text_file(options.lcm, std::string(bytes.begin(), bytes.end()));
}

/// Least, greatest and mean of a column.
struct ColumnRange {
  double low = 0, high = 0, mean = 0;
};

ColumnRange range_of(const ScopeRecord& record, std::size_t column) {
  ColumnRange out{HUGE_VAL, -HUGE_VAL, 0};
  std::size_t known = 0;
  for (std::size_t row = 0; row < record.rows(); ++row) {
    const double value = record.value(row, column);
    if (std::isnan(value)) continue;
    out.low = std::min(out.low, value);
    out.high = std::max(out.high, value);
    out.mean += value;
    ++known;
  }
  out.mean = known > 0 ? out.mean / static_cast<double>(known) : std::nan("");
  if (known == 0) out.low = out.high = out.mean;
  return out;
}

void tell_record(const ScopeRecord& record, bool json) {
  nlohmann::ordered_json columns = nlohmann::ordered_json::array();
  if (!json)
    fmt::print("{} periods of {:g} ms, {} lost\n{:<24} {:<9} {:>14} {:>14} {:>14}\n", record.rows(),
               1000 * record.period_s, record.lost(), "signal", "unit", "least", "mean", "greatest");
  for (std::size_t k = 0; k < record.columns.size(); ++k) {
    const ColumnRange range = range_of(record, k);
    const ScopeRecord::Column& column = record.columns[k];
    columns.push_back({{"signal", column.name},
                       {"unit", column.unit},
                       {"least", range.low},
                       {"mean", range.mean},
                       {"greatest", range.high}});
    if (!json)
      fmt::print("{:<24} {:<9} {:>14.6g} {:>14.6g} {:>14.6g}\n", column.name, column.unit, range.low,
                 range.mean, range.high);
  }
  if (!json) return;
  const nlohmann::ordered_json out{{"rows", record.rows()},
                                   {"lost", record.lost()},
                                   {"period_s", record.period_s},
                                   {"trigger_period", record.trigger_period.value_or(0)},
                                   {"signals", columns}};
  fmt::print("{}\n", out.dump());
}

/// Fetches row by row what the daemon keeps, from some periods before now on.
class ScopeFeed {
 public:
  ScopeFeed(ScopeClient& client, std::vector<std::string> names, std::int64_t rows_before)
      : client_(client), names_(std::move(names)), next_(-rows_before - 1) {}

  /// All that is new; false if nothing was.
  bool take(ScopeCapture& capture) {
    const trunnion::scope_data_t data = client_.rows(names_, next_);
    if (!begun_) begin_ = data.newest_period;
    begun_ = true;
    for (std::size_t row = 0; row < data.period.size(); ++row)
      capture.take(static_cast<std::uint64_t>(data.period[row]), data.value.data() + row * names_.size(),
                   data.period[row] <= begin_);
    if (data.period.empty()) return false;
    next_ = data.period.back() + 1;
    return true;
  }

 private:
  ScopeClient& client_;
  std::vector<std::string> names_;
  std::int64_t next_, begin_ = -1;
  bool begun_ = false;
};

ScopeWish wish_of(const ScopeOptions& options) {
  ScopeWish wish{options.seconds, options.before_s, std::nullopt, options.rolling};
  if (!options.trigger.empty()) wish.trigger = parse_trigger(options.trigger);
  return wish;
}

// Until it is done, somebody presses Ctrl-C, or patience is over. A rolling one writes its files every
// second.
void run_scope(const ScopeOptions& options, ScopeFeed& feed, ScopeCapture& capture) {
  const InterruptGuard guard;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(options.patience_s);
  auto redraw = std::chrono::steady_clock::now() + kRedraw;
  while (!capture.done() && !scope_interrupted && std::chrono::steady_clock::now() < end) {
    while (feed.take(capture) && !capture.done() && !scope_interrupted) {
    }
    if (options.rolling && std::chrono::steady_clock::now() > redraw) {
      write_files(options, capture.record());
      redraw += kRedraw;
    }
    if (!capture.done()) std::this_thread::sleep_for(kPause);
  }
}

Exit record_signals(const ScopeOptions& options, ScopeClient& client, const std::string& machine) {
  for (const std::string& path : {options.csv, options.svg, options.lcm}) check_text_file(path);
  const trunnion::scope_signals_t list = client.signals();
  const ScopeWish wish = wish_of(options);
  ScopeRecord empty;
  empty.machine = machine;
  empty.period_s = list.period_s;
  empty.columns = chosen(options.signals, columns_of(list));
  std::vector<std::string> names;
  for (const ScopeRecord::Column& column : empty.columns) names.push_back(column.name);
  if (wish.trigger) names.push_back(chosen({wish.trigger->signal}, columns_of(list)).front().name);
  ScopeCapture capture(wish, empty);
  ScopeFeed feed(client, names, std::llround(options.before_s / list.period_s));
  if (wish.trigger && !options.json) fmt::print(stderr, "waiting for '{}'; Ctrl-C ends\n", options.trigger);
  run_scope(options, feed, capture);
  if (wish.trigger && !capture.triggered() && !options.rolling) {
    fmt::print(stderr, "nothing triggered: '{}' did not come\n", options.trigger);
    return Exit::kMachineFault;
  }
  write_files(options, capture.record());
  tell_record(capture.record(), options.json);
  return Exit::kDone;
}

// A recording of before, or a fault's: other files of it, or fewer signals.
Exit read_record(const ScopeOptions& options) {
  ScopeRecord record;
  try {
    record = parse_scope_csv(read_named_file(options.read), options.read);
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadProgram;
  }
  if (!options.signals.empty()) record = only(record, chosen(options.signals, record.columns));
  write_files(options, record);
  tell_record(record, options.json);
  return Exit::kDone;
}

Exit scope(const ScopeOptions& options) {
  if (!options.read.empty()) return read_record(options);
  if (!options.list && options.signals.empty())
    throw CLI::RequiredError("a signal (trunnion scope --list tells them)");
  const Machine machine = client_machine(options.machine, "");
  LcmConfig names = read_lcm(machine.root, machine.name);
  ScopeClient client(names, read_access(machine.root), options.timeout_s);
  if (options.list) return show_list(client, options.json);
  try {
    return record_signals(options, client, machine.name);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--trigger", error.what());
  }
}

}  // namespace

void add_scope(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ScopeOptions>();
  CLI::App* command = app.add_subcommand(
      "scope",
      "Record any signal of the machine at every period, with triggers: what drives, axes and inputs did");
  command->add_option("signals", options->signals, "names, as X.measured; '*.force' is those of all joints");
  command->add_flag("--list", options->list, "tell all signals with their units");
  command->add_option("--seconds", options->seconds, "how long to record from the trigger on")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--before", options->before_s, "and how long before it")->check(CLI::NonNegativeNumber);
  command->add_option("--trigger", options->trigger,
                      "what to wait for; without it the recording begins at once");
  command->add_flag("--rolling", options->rolling,
                    "go on until Ctrl-C; the files have the last --seconds and are written every second");
  command->add_option("--csv", options->csv, "write a table");
  command->add_option("--svg", options->svg, "write a picture");
  command->add_option("--lcm", options->lcm, "write a log of LCM (scope_data_t)");
  command->add_option("--read", options->read, "instead of a daemon: a table that --csv or a fault wrote");
  command->add_option("--machine,-m", options->machine, kMachineHelp)->envname("TRUNNION_MACHINE");
  add_timeout(*command, options->timeout_s);
  command->add_option("--patience", options->patience_s, "seconds to wait for the trigger and the end")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--json", options->json, "summary or list as JSON");
  command->footer(kScopeFooter);
  command->callback([options, &exit] { exit = scope(*options); });
}

}  // namespace trn
