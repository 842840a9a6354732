#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <array>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <random>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "kinematics/factory.h"
#include "kinematics/platform_kinematics.h"
#include "tests/kinematics/kdl_chain.h"
#include "tests/support/paths.h"

// ns per forward and inverse call of every machine, beside KDL's generic solvers (serial machines) and a
// plain textbook Newton (hexapod): build/release/bench_kinematics
namespace {

using namespace trn;

constexpr int kPoses = 256;

struct Bench {
  Machine machine;
  std::unique_ptr<Kinematics> kin;
  std::array<Words, kPoses> words;
  std::array<JointVec, kPoses> q, seed;
  std::array<Pose, kPoses> X_BS;
};

Words random_words(std::mt19937& random, const Vec3& home) {
  std::uniform_real_distribution<> unit(-1, 1);
  Words words;
  words << home + 60 * Vec3(unit(random), unit(random), unit(random)), 0.3 * unit(random), 0.3 * unit(random),
      0.3 * unit(random);
  return words;
}

/// Legal poses, and seeds one step of a program away.
Bench make_bench(const char* name) {
  Machine machine = read_machine(load_config(source_dir() + "/configs/" + name + ".toml"));
  auto kin = make_kinematics(machine);
  Bench bench{std::move(machine), std::move(kin), {}, {}, {}, {}};
  Vec3 home = Vec3::Zero();
  if (const auto* platform = dynamic_cast<const PlatformKinematics*>(bench.kin.get()))
    home =
        platform->spindle_from_platform(translation(bench.machine.root.table("kinematics").vec3("home_mm")))
            .p;
  std::mt19937 random(1);
  for (int i = 0; i < kPoses; ++i) {
    do bench.words[i] = random_words(random, home);
    while (bench.kin->joints_from_words(bench.words[i], bench.q[i]) != KinStatus::kOk);
    bench.kin->forward(bench.q[i], bench.X_BS[i]);
    bench.seed[i] = bench.q[i].array() + 0.01;
  }
  return bench;
}

void forward(benchmark::State& state, const char* name) {
  const Bench bench = make_bench(name);
  Pose X;
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(bench.kin->forward(bench.q[i++ % kPoses], X));
}

/// As the planner calls it: rotary words programmed, so the seed's rotary joints are kept.
void inverse_programmed(benchmark::State& state, const char* name) {
  const Bench bench = make_bench(name);
  JointVec q;
  int i = 0;
  for (auto _ : state) {
    const int k = i++ % kPoses;
    benchmark::DoNotOptimize(bench.kin->inverse(bench.X_BS[k], bench.q[k], q));
  }
}

/// From another pose's joints: branch and angles are found from the axis.
void inverse_free(benchmark::State& state, const char* name) {
  const Bench bench = make_bench(name);
  JointVec q;
  int i = 0;
  for (auto _ : state) {
    const int k = i++ % kPoses;
    benchmark::DoNotOptimize(bench.kin->inverse(bench.X_BS[k], bench.seed[k], q));
  }
}

void kdl_forward(benchmark::State& state, const char* name) {
  const Bench bench = make_bench(name);
  const KdlChain kdl = make_kdl_chain(bench.machine);
  KDL::ChainFkSolverPos_recursive solver(kdl.chain);
  std::vector<KDL::JntArray> q;
  for (const JointVec& each : bench.q) q.push_back(kdl.joints(each));
  KDL::Frame X;
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(solver.JntToCart(q[i++ % kPoses], X));
}

/// Levenberg-Marquardt, from the same seeds; the turn about the tool has no weight.
void kdl_inverse(benchmark::State& state, const char* name) {
  const Bench bench = make_bench(name);
  const KdlChain kdl = make_kdl_chain(bench.machine);
  Eigen::Matrix<double, 6, 1> weights;
  weights << 1, 1, 1, 100, 100, 100;
  KDL::ChainIkSolverPos_LMA solver(kdl.chain, weights, 1e-9, 500, 1e-15);
  KDL::ChainFkSolverPos_recursive truth(kdl.chain);
  std::vector<KDL::JntArray> seed;
  std::vector<KDL::Frame> X(kPoses);
  for (int k = 0; k < kPoses; ++k) {
    seed.push_back(kdl.joints(bench.seed[k]));
    truth.JntToCart(kdl.joints(bench.q[k]), X[k]);
  }
  KDL::JntArray out(static_cast<unsigned>(kdl.joint.size()));
  int i = 0;
  for (auto _ : state) {
    const int k = i++ % kPoses;
    benchmark::DoNotOptimize(solver.CartToJnt(seed[k], X[k], out));
  }
}

/// What a textbook writes: six unknowns x y z and three Euler angles, Jacobian by finite differences, dense
/// solve, from the home pose until the step vanishes.
class TextbookHexapod {
 public:
  explicit TextbookHexapod(const Machine& machine) {
    for (const ConfigTable& leg : machine.root.table("kinematics").tables("leg")) {
      base_.push_back(leg.vec3("base_mm"));
      platform_.push_back(leg.vec3("platform_mm"));
    }
  }

  bool solve(const Eigen::VectorXd& legs, Eigen::VectorXd& x) const {
    for (int iteration = 0; iteration < 30; ++iteration) {
      const Eigen::VectorXd error = lengths(x) - legs;
      Eigen::MatrixXd J(6, 6);
      for (int i = 0; i < 6; ++i)
        J.col(i) = (lengths(x + 1e-6 * Eigen::VectorXd::Unit(6, i)) - legs - error) / 1e-6;
      const Eigen::VectorXd step = J.partialPivLu().solve(error);
      x -= step;
      if (step.norm() < 1e-10) return true;
    }
    return false;
  }

 private:
  Eigen::VectorXd lengths(const Eigen::VectorXd& x) const {
    const Mat3 R = rot_z(x[5]) * rot_y(x[4]) * rot_x(x[3]);
    Eigen::VectorXd out(6);
    for (std::size_t i = 0; i < 6; ++i)
      out[static_cast<int>(i)] = (x.head<3>() + R * platform_[i] - base_[i]).norm();
    return out;
  }

  std::vector<Vec3> base_, platform_;
};

void textbook_forward(benchmark::State& state) {
  const Bench bench = make_bench("hexapod");
  const TextbookHexapod textbook(bench.machine);
  int i = 0;
  for (auto _ : state) {
    Eigen::VectorXd x(6);
    x << 0, 0, 640, 0, 0, 0;
    benchmark::DoNotOptimize(textbook.solve(bench.q[i++ % kPoses], x));
  }
}

void register_all() {
  for (const char* name : {"cradle", "head", "head_table", "mill", "micro_stage", "hexapod", "rail_mill"}) {
    const auto add = [&](const char* what, void (*run)(benchmark::State&, const char*)) {
      benchmark::RegisterBenchmark(fmt::format("{}/{}", name, what).c_str(),
                                   [run, name](benchmark::State& state) { run(state, name); });
    };
    const bool serial = std::string_view(name) != "hexapod" && std::string_view(name) != "rail_mill";
    add("forward", forward);
    if (serial) add("forward_kdl", kdl_forward);
    add("inverse_programmed", inverse_programmed);
    add("inverse_free", inverse_free);
    if (serial && std::string_view(name) != "mill" && std::string_view(name) != "micro_stage")
      add("inverse_kdl", kdl_inverse);
  }
  benchmark::RegisterBenchmark("hexapod/forward_textbook", textbook_forward);
}

}  // namespace

int main(int argc, char** argv) {
  register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
