#include "kernel/commands/micromill.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <memory>

#include "core/config.h"
#include "interp/move.h"
#include "kernel/micromill/experiment.h"

namespace trn {

namespace {

struct MicromillOptions {
  std::string machine, networks, pictures;
  std::uint64_t seed = 0;
  int plants = 1, parts = 5, delays = 2, spacing = 8, nodes = 16, layers = 1, starts = 3, iterations = 120;
  double standing_mm = 0.0015, gain = 1;
  bool json = false, no_test_cut = false;
};

void tell(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\033[K{}", what);
}

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

Exit train(const MicromillOptions& options) {
  const StageLab lab(options.machine, options.seed);
  const TrainingRuns runs = training_runs(lab);
  tell("learns");
  const StageNetworks networks = train_stage(lab, runs.sines, runs.validation, choice(options));
  tell("");
  write_networks(options.networks, networks);
  const char* axes[] = {"X", "Y"};
  for (std::size_t i = 0; i < 2; ++i) {
    const TrainingRecord& r = networks.record[i];
    fmt::print(
        "{}: {} samples, {} iterations; explains {:.1f} % of the training runs' variance, {:.1f} % of unseen "
        "runs' "
        "(left {:.3f} N rms)\n",
        axes[i], r.samples, r.iterations, 100 * r.explained_training, 100 * r.explained_validation,
        r.rms_validation_N);
  }
  fmt::print("written to {}\n", options.networks);
  return Exit::kDone;
}

Exit stiffness(const MicromillOptions& options) {
  const StageLab lab(options.machine, options.seed);
  StageNetworks networks;
  if (options.networks.empty()) {
    const TrainingRuns runs = training_runs(lab);
    networks = train_stage(lab, runs.sines, runs.validation, choice(options));
  } else {
    networks = read_networks(options.networks);
  }
  const char* axes[] = {"X", "Y"};
  for (int axis = 0; axis < 2; ++axis) {
    const PressingResult result = press(lab, networks, axis);
    fmt::print(
        "{}: k_t = {:.2f} N/mm (+- {:.2f}; the line leaves {:.3f} N rms; the simulator's tool has {:.2f})\n",
        axes[axis], result.fit.stiffness_N_mm, result.fit.sigma_N_mm, result.fit.rms_N, result.true_N_mm);
  }
  return Exit::kDone;
}

Exit sweep(const MicromillOptions& options) {
  const StageLab lab(options.machine, options.seed);
  const TrainingRuns runs = training_runs(lab);
  fmt::print(
      "layers  nodes  delays  weights  X: unseen explained %, left N   Y: unseen explained %, left N\n");
  for (const int layers : {1, 2})
    for (const int nodes : {10, 12, 16})
      for (const int delays : {2, 4, 6}) {
        MicromillOptions shape = options;
        shape.layers = layers;
        shape.nodes = nodes;
        shape.delays = delays;
        const TrainChoice chosen = choice(shape);
        const StageNetworks n = train_stage(lab, runs.sines, runs.validation, chosen);
        fmt::print("{:<7} {:<6} {:<7} {:<8} {:<22.2f} {:<8.3f} {:<22.2f} {:.3f}\n", layers, nodes, delays,
                   chosen.shape.weight_count(), 100 * n.record[0].explained_validation,
                   n.record[0].rms_validation_N, 100 * n.record[1].explained_validation,
                   n.record[1].rms_validation_N);
        std::fflush(stdout);
      }
  return Exit::kDone;
}

Exit experiment(const MicromillOptions& options) {
  ExperimentOptions run;
  run.machine = options.machine;
  run.first_seed = options.seed;
  run.plants = options.plants;
  run.parts = options.parts;
  run.gain = options.gain;
  run.test_cut = !options.no_test_cut;
  run.training = choice(options);
  run.pictures = options.pictures;
  run.progress = tell;
  const std::vector<PlantResult> plants = run_experiment(run);
  tell("");
  fmt::print("{}", options.json ? experiment_json(run, plants) : experiment_text(run, plants));
  return summarize(plants).unstable == 0 ? Exit::kDone : Exit::kMachineFault;
}

Exit guarded(Exit (*action)(const MicromillOptions&), const MicromillOptions& options) {
  try {
    return action(options);
  } catch (const ConfigError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadConfig;
  } catch (const ProgramError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadProgram;
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
      .add_option("--machine", options->machine,
                  "machine config (.toml) with a section [corrections.deflection]")
      ->required();
  command.add_option("--seed", options->seed, "which simulated stage; 0: the nominal one");
  add_training_options(command, *options);
  command.callback([options, action, &exit] { exit = guarded(action, *options); });
  return command;
}

}  // namespace

void add_micromill(CLI::App& app, Exit& exit) {
  CLI::App& parent = *app.add_subcommand("micromill",
                                         "Cutting force from the motors' current and position, and the "
                                         "tool's deflection from the force, on a simulated "
                                         "micro-mill that differs from the estimator's model.");
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
  CLI::App& whole =
      add_one(parent, "experiment",
              "The whole of it: train, validate, press, cut round and square parts, print the paper's table "
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
  whole.add_flag("--json", with->json, "results as JSON (mm, N)");
}

}  // namespace trn
