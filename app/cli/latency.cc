#include "app/daemon/latency.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "app/cli/commands.h"
#include "app/daemon/realtime.h"
#include "app/daemon/tick_thread.h"
#include "app/lab/latency_picture.h"
#include "app/lab/text_file.h"
#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/realtime_config.h"
#include "core/time_histogram.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

struct LatencyOptions {
  std::string machine, svg;
  double seconds = 10, period_us = 0;
  int priority = -1, cpu = -2;
  bool json = false;
};

constexpr const char kLatencyFooter[] =
    "Example: trunnion latency --seconds 3600 --svg latency.svg      beside the load that the machine will "
    "have\n"
    "A thread wakes once a period, as the daemon's tick does. How late it wakes is the host's doing: kernel, "
    "other\n"
    "programs, power saving. With --machine it also runs that machine's tick, at rest on simulated drives.\n"
    "The verdict: good, latest wake-up and longest tick took half of a period at most; tight, less than the "
    "whole; no,\n"
    "more than that. What did not happen while it measured may still come: measure for hours before you "
    "trust it.\n"
    "Exit codes: 0 measured, 3 bad config, 4 the clock refuses, 5 usage.";

/// A machine that stands, on drives in this process.
struct StandingMachine {
  explicit StandingMachine(const std::string& path)
      : assembly(assemble(path)), queue(16), cycle(make_cycle(assembly, queue, ProgramStops::kWait)) {
    assembly.drives->bring_up();
  }
  Assembly assembly;
  MotionQueue queue;
  Cycle cycle;
};

void show_progress(double seconds, const LatencyOptions& options, const LoopStatistics& statistics) {
  const auto begin = std::chrono::steady_clock::now();
  const auto gone_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  for (double next_s = 2; gone_s() < seconds;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (options.json || gone_s() < next_s) continue;
    next_s += 2;
    fmt::print(stderr, "\r{:.0f} of {:.0f} s: latest wake-up {:.0f} us, longest tick {:.0f} us ", gone_s(),
               seconds, statistics.wake.max_us(), statistics.tick.max_us());
    std::fflush(stderr);
  }
  if (!options.json && seconds >= 2) fmt::print(stderr, "\n");
}

void print_histogram(const char* what, const TimeHistogram& histogram) {
  constexpr double kBarChars = 50;
  const std::vector<TimeHistogram::Bucket> buckets = histogram.buckets();
  fmt::print("{}: median {:.0f} us, 99.9 % {:.0f} us, worst {:.0f} us\n", what, histogram.percentile_us(0.5),
             histogram.percentile_us(0.999), histogram.max_us());
  double most = 1;
  for (const TimeHistogram::Bucket& bucket : buckets) most = std::max(most, std::log10(1.0 + bucket.count));
  for (const TimeHistogram::Bucket& bucket : buckets) {
    const auto bar = static_cast<std::size_t>(std::ceil(kBarChars * std::log10(1.0 + bucket.count) / most));
    if (bucket.count > 0)
      fmt::print("  below {:>9.2f} us {:>10} {}\n", bucket.edge_us, bucket.count, std::string(bar, '#'));
  }
}

void print_text(const LoopStatistics& statistics, const std::vector<std::string>& refused, double period_us) {
  for (const std::string& what : refused) fmt::print("NOT REAL TIME: {}\n", what);
  print_histogram("wake-up, late by", statistics.wake);
  print_histogram("tick, takes", statistics.tick);
  fmt::print("{} periods of {:g} us, {} overrun\n", statistics.periods.load(), period_us,
             statistics.overruns.load());
  const std::vector<PeriodVerdict> verdicts =
      judge_periods(statistics.wake.max_us(), statistics.tick.max_us());
  for (const PeriodVerdict& verdict : verdicts)
    fmt::print("  period {:>4g} us: {}\n", verdict.period_us, to_string(verdict.fit));
  const double good_us = shortest_good_us(verdicts);
  if (good_us > 0)
    fmt::print("As far as was seen, this host keeps a period of {:g} us well (period_s = {:g}).\n", good_us,
               good_us / 1e6);
  else
    fmt::print(
        "As far as was seen, this host keeps no period well; a real-time kernel, real-time rights and an "
        "isolated "
        "processor help, in this order.\n");
}

Json histogram_json(const TimeHistogram& histogram) {
  Json buckets = Json::array();
  for (const TimeHistogram::Bucket& bucket : histogram.buckets())
    buckets.push_back({bucket.edge_us, bucket.count});
  return {{"p50_us", histogram.percentile_us(0.5)},
          {"p999_us", histogram.percentile_us(0.999)},
          {"max_us", histogram.max_us()},
          {"edge_us_and_count", buckets}};
}

void print_json(const LoopStatistics& statistics, const std::vector<std::string>& refused, double period_us) {
  Json verdicts;
  for (const PeriodVerdict& verdict : judge_periods(statistics.wake.max_us(), statistics.tick.max_us()))
    verdicts[fmt::format("{:g}", verdict.period_us)] = to_string(verdict.fit);
  const Json out{{"period_us", period_us},
                 {"periods", statistics.periods.load()},
                 {"overruns", statistics.overruns.load()},
                 {"realtime", refused.empty()},
                 {"refused", refused},
                 {"wake", histogram_json(statistics.wake)},
                 {"tick", histogram_json(statistics.tick)},
                 {"verdict_of_period_us", verdicts}};
  fmt::print("{}\n", out.dump());
}

void write_svg(const std::string& path, const LoopStatistics& statistics, double period_us) {
  const std::string title =
      fmt::format("{} periods of {:g} us: latest wake-up {:.0f} us, longest tick {:.0f} us",
                  statistics.periods.load(), period_us, statistics.wake.max_us(), statistics.tick.max_us());
  write_text_file(path, latency_svg(title, statistics.wake.buckets(), statistics.tick.buckets()));
}

Exit measure(const LatencyOptions& options) {
  check_text_file(options.svg);
  std::optional<StandingMachine> machine;
  if (!options.machine.empty()) machine.emplace(options.machine);
  RealtimeConfig realtime = machine ? machine->assembly.realtime : RealtimeConfig();
  if (options.priority >= 0) realtime.priority = options.priority;
  if (options.cpu >= -1) realtime.cpu = options.cpu;
  double period_us = machine ? 1e6 * machine->assembly.machine.period_s : 1000;
  if (options.period_us > 0) period_us = options.period_us;
  const std::string memory = realtime.lock_memory ? lock_memory() : "";
  TickThread thread(realtime, period_us / 1e6, [&](int, const LoopStatistics&) {
    if (machine) machine->cycle.tick();
  });
  std::vector<std::string> refused = thread.refused();
  if (!memory.empty()) refused.push_back(memory);
  show_progress(options.seconds, options, thread.statistics());
  thread.end();  // text, picture and verdict are of the same periods
  if (thread.failed()) throw std::runtime_error("the clock of this host refuses to wait for a moment");
  options.json ? print_json(thread.statistics(), refused, period_us)
               : print_text(thread.statistics(), refused, period_us);
  if (!options.svg.empty()) write_svg(options.svg, thread.statistics(), period_us);
  return Exit::kDone;
}

}  // namespace

void add_latency(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<LatencyOptions>();
  CLI::App* command = app.add_subcommand("latency", "Measure how well this computer keeps a period");
  command->add_option("--seconds", options->seconds, "how long to measure (default 10)")
      ->check(CLI::Range(0.1, 1e7));
  command->add_option("--machine,-m", options->machine,
                      "also run this machine's tick, with its period and [realtime]");
  command->add_option("--period-us", options->period_us, "period (default: the machine's, or 1000)")
      ->check(CLI::Range(50.0, 1e6));
  command->add_option("--priority", options->priority, "SCHED_FIFO, 1 to 98; 0: none")
      ->check(CLI::Range(0, 98));
  command->add_option("--cpu", options->cpu, "processor; -1: any")->check(CLI::Range(-1, 1023));
  command->add_option("--svg", options->svg, "also draw both histograms into this file");
  command->add_flag("--json", options->json, "one JSON object instead of text");
  command->footer(kLatencyFooter);
  command->callback([options, &exit] {
    try {
      exit = measure(*options);
    } catch (...) {
      exit = tell_exception(Exit::kMachineFault);
    }
  });
}

}  // namespace trn
