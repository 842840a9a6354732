#include "app/cli/micromill.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "app/lab/micromill/experiment.h"
#include "app/lab/micromill/stage_lab.h"
#include "app/lab/text_file.h"
#include "compensation/micromill/friction_network.h"
#include "core/config.h"
#include "interp/move.h"

namespace trn {

namespace {

struct MicromillOptions {
  std::string machine, networks, pictures;
  std::optional<std::uint64_t> seed;
  int plants = 1, parts = 5, delays = 2, spacing = 8, nodes = 16, layers = 1, starts = 3, iterations = 120;
  double standing_mm = 0.0015, gain = 1;
  bool json = false, no_test_cut = false;
};

using Json = nlohmann::ordered_json;

void tell(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\033[K{}", what);
}

void print_now(const std::string& text) {
  tell("");
  fmt::print("{}", text);
  std::fflush(stdout);
}

/// What is done and how long it may still take.
class DoneLine {
 public:
  void operator()(const std::string& doing, double done) const {
    const double spent_s = std::chrono::duration<double>(Clock::now() - start_).count();
    if (done < 0.02)
      tell(doing);
    else
      tell(fmt::format("{} ({:.0f} %, about {:.0f} s more)", doing, 100 * done, spent_s * (1 - done) / done));
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

TrainChoice choice(const MicromillOptions& options) {
  TrainChoice out;
  out.shape.line = {options.delays, options.spacing};
  out.shape.standing_mm = options.standing_mm;
  out.shape.nodes = options.nodes;
  out.shape.layers = options.layers;
  out.options.starts = options.starts;
  out.options.iterations_max = options.iterations;
  return out;
}

struct TrainingRuns {
  StageRun sines, validation;
};

TrainingRuns training_runs(const StageLab& lab) {
  tell("runs sines on the stage");
  StageRun sines = lab.run(sine_program(), {}, nullptr);
  tell("runs other sines and ramps");
  StageRun validation = lab.run(validation_program(), {}, nullptr);
  tell("");
  return {std::move(sines), std::move(validation)};
}

StageNetworks learn(const StageLab& lab, const TrainingRuns& runs, const MicromillOptions& options) {
  tell("learns friction and ripple");
  StageNetworks networks = train_stage(lab, runs.sines, runs.validation, choice(options));
  tell("");
  return networks;
}

Json record_json(const TrainingRecord& r) {
  return {{"samples", r.samples},
          {"iterations", r.iterations},
          {"explained_training", r.explained_training},
          {"explained_validation", r.explained_validation},
          {"rms_training_N", r.rms_training_N},
          {"rms_validation_N", r.rms_validation_N}};
}

Exit train(const MicromillOptions& options) {
  check_text_file(options.networks);
  const StageLab lab(options.machine, options.seed);
  const StageNetworks networks = learn(lab, training_runs(lab), options);
  write_networks(options.networks, networks);
  Json out = {{"networks", options.networks}, {"seed", lab.seed()}};
  for (std::size_t i = 0; i < 2; ++i) {
    const TrainingRecord& r = networks.record[i];
    out[kStageAxes[i]] = record_json(r);
    if (!options.json)
      fmt::print(
          "{}: {} samples, {} iterations; explains {:.1f} % of the training runs' variance, {:.1f} % of "
          "unseen runs' (left {:.3f} N rms)\n",
          kStageAxes[i], r.samples, r.iterations, 100 * r.explained_training, 100 * r.explained_validation,
          r.rms_validation_N);
  }
  fmt::print("{}\n", options.json ? out.dump(2) : fmt::format("written to {}", options.networks));
  return Exit::kDone;
}

Exit stiffness(const MicromillOptions& options) {
  const StageLab lab(options.machine, options.seed);
  const StageNetworks networks =
      options.networks.empty() ? learn(lab, training_runs(lab), options) : read_networks(options.networks);
  Json out = {{"seed", lab.seed()}};
  for (int axis = 0; axis < 2; ++axis) {
    tell(fmt::format("presses the tool along {}", kStageAxes[axis]));
    const PressingResult result = press(lab, networks, axis);
    tell("");
    out[kStageAxes[axis]] = {{"stiffness_N_mm", result.fit.stiffness_N_mm},
                             {"sigma_N_mm", result.fit.sigma_N_mm},
                             {"rms_N", result.fit.rms_N},
                             {"true_N_mm", result.true_N_mm}};
    if (!options.json)
      fmt::print(
          "{}: k_t = {:.2f} N/mm (+- {:.2f}; the line leaves {:.3f} N rms; the simulator's tool has "
          "{:.2f})\n",
          kStageAxes[axis], result.fit.stiffness_N_mm, result.fit.sigma_N_mm, result.fit.rms_N,
          result.true_N_mm);
  }
  if (options.json) fmt::print("{}\n", out.dump(2));
  return Exit::kDone;
}

/// The shapes that docs/sources.md S5.6 compares, and beyond.
std::vector<MicromillOptions> sweep_shapes(const MicromillOptions& options) {
  std::vector<MicromillOptions> shapes;
  for (const int layers : {1, 2})
    for (const int nodes : {10, 12, 16})
      for (const int delays : {2, 4, 6}) {
        shapes.push_back(options);
        shapes.back().layers = layers;
        shapes.back().nodes = nodes;
        shapes.back().delays = delays;
      }
  return shapes;
}

Exit sweep(const MicromillOptions& options) {
  const StageLab lab(options.machine, options.seed);
  const TrainingRuns runs = training_runs(lab);
  const std::vector<MicromillOptions> shapes = sweep_shapes(options);
  if (!options.json)
    print_now(
        "layers  nodes  delays  weights  X: unseen explained %, left N   Y: unseen explained %, left N\n");
  Json out = Json::array();
  const DoneLine progress;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    progress(fmt::format("trains shape {} of {}", k + 1, shapes.size()),
             static_cast<double>(k) / static_cast<double>(shapes.size()));
    const MicromillOptions& shape = shapes[k];
    const TrainChoice chosen = choice(shape);
    const StageNetworks n = train_stage(lab, runs.sines, runs.validation, chosen);
    const TrainingRecord &x = n.record[0], &y = n.record[1];
    const int weights = chosen.shape.weight_count();
    out.push_back({{"layers", shape.layers},
                   {"nodes", shape.nodes},
                   {"delays", shape.delays},
                   {"weights", weights},
                   {"X", record_json(x)},
                   {"Y", record_json(y)}});
    if (!options.json)
      print_now(fmt::format("{:<7} {:<6} {:<7} {:<8} {:<22.2f} {:<8.3f} {:<22.2f} {:.3f}\n", shape.layers,
                            shape.nodes, shape.delays, weights, 100 * x.explained_validation,
                            x.rms_validation_N, 100 * y.explained_validation, y.rms_validation_N));
  }
  if (options.json) print_now(out.dump(2) + "\n");
  return Exit::kDone;
}

Exit experiment(const MicromillOptions& options) {
  if (!options.pictures.empty()) make_result_folder(options.pictures);
  ExperimentOptions run;
  run.machine = options.machine;
  run.first_seed = StageLab(options.machine, options.seed).seed();
  run.plants = options.plants;
  run.parts = options.parts;
  run.gain = options.gain;
  run.test_cut = !options.no_test_cut;
  run.training = choice(options);
  run.pictures = options.pictures;
  run.progress = DoneLine();
  if (!options.json) run.finished = [&run](const PlantResult& plant) { print_now(plant_text(run, plant)); };
  const std::vector<PlantResult> plants = run_experiment(run);
  print_now(options.json ? experiment_json(run, plants) : summary_text(run, plants));
  if (!options.pictures.empty()) fmt::print(stderr, "pictures in {}\n", options.pictures);
  return summarize(plants).unstable == 0 ? Exit::kDone : Exit::kMachineFault;
}

Exit guarded(Exit (*action)(const MicromillOptions&), const MicromillOptions& options) {
  try {
    return action(options);
  } catch (const ConfigError& error) {
    tell("");
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadConfig;
  } catch (const ProgramError& error) {
    tell("");
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadProgram;
  } catch (const std::invalid_argument& error) {
    tell("");
    fmt::print(stderr, "{}: fewer layers, nodes or delays\n", error.what());
    return Exit::kUsage;
  }
}

void add_training_options(CLI::App& command, MicromillOptions& options) {
  command.add_option("--delays", options.delays, "taps behind the first")
      ->check(CLI::Range(1, DelayLine::kDelaysMax));
  command.add_option("--spacing", options.spacing, "periods from tap to tap")
      ->check(CLI::Range(1, DelayLine::kSpacingMax));
  command
      .add_option("--standing-mm", options.standing_mm,
                  "an axis that travels less from tap to tap counts as standing")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--nodes", options.nodes, "nodes of a hidden layer")
      ->check(CLI::Range(1, FrictionNetwork::kNodesMax));
  command.add_option("--layers", options.layers, "hidden layers")
      ->check(CLI::Range(1, FrictionNetwork::kLayersMax));
  command.add_option("--starts", options.starts, "random starting points; the best result is kept")
      ->check(CLI::Range(1, 100));
  command.add_option("--iterations", options.iterations, "the most of each start")
      ->check(CLI::Range(1, 10000));
}

CLI::App& add_one(CLI::App& parent, const char* name, const char* words,
                  std::shared_ptr<MicromillOptions> options, Exit (*action)(const MicromillOptions&),
                  Exit& exit) {
  CLI::App& command = *parent.add_subcommand(name, words);
  command.option_defaults()->always_capture_default();
  command
      .add_option("--machine,-m", options->machine,
                  "the machine by its name, or its config (.toml), with a section [corrections.deflection]")
      ->required();
  command.add_option(
      "--seed", options->seed,
      "which simulated stage; 0: the nominal one; without it the config's own ([drives] seed)");
  command.add_flag("--json", options->json, "results as JSON (mm, N)");
  add_training_options(command, *options);
  command.callback([options, action, &exit] { exit = guarded(action, *options); });
  return command;
}

}  // namespace

void add_micromill(CLI::App& app, Exit& exit) {
  CLI::App& parent = *app.add_subcommand(
      "micromill",
      "Estimate cutting force and tool deflection from the motors' current, on a simulated micro-mill.");
  parent.require_subcommand(1);
  const auto options = [] { return std::make_shared<MicromillOptions>(); };
  auto with = options();
  add_one(parent, "train",
          "Learn friction and force ripple from sines that the kernel drives; write the networks.", with,
          train, exit)
      .add_option("--out", with->networks, "file for the networks (.toml)")
      ->required();
  with = options();
  add_one(parent, "stiffness", "Press the tool slowly against a block and fit its stiffness along each axis.",
          with, stiffness, exit)
      .add_option("--networks", with->networks, "file written by train; without it, training comes first");
  with = options();
  add_one(parent, "sweep", "Train networks of several layers, nodes and delays and print how well each does.",
          with, sweep, exit);
  with = options();
  CLI::App& whole = add_one(
      parent, "experiment",
      "The whole of it: train, validate, press, cut round and square parts, print the published table "
      "beside ours, and cut them again with the path correction.",
      with, experiment, exit);
  whole.add_option("--plants", with->plants, "how many stages, seeds counting up from --seed")
      ->check(CLI::Range(1, 1000));
  whole.add_option("--parts", with->parts, "parts of each shape on every stage")->check(CLI::Range(1, 50));
  whole.add_option("--gain", with->gain, "of the path correction in the second cut; 0: no second cut")
      ->check(CLI::Range(0.0, 1.2));
  whole.add_flag(
      "--no-test-cut", with->no_test_cut,
      "predict from the pressing test alone; else one square part is cut and measured first, which "
      "tells how much of the mean bending the surface shows");
  whole.add_option("--pictures", with->pictures, "folder for the figures (.svg), of the first stage");
}

}  // namespace trn
