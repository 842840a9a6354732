#include "compensation/micromill/friction_network.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "compensation/fit/network_training.h"
#include "core/config.h"
#include "tests/support/allocation_counter.h"

namespace trn {
namespace {

FrictionNetwork::Shape shape_of(int layers, int nodes, int delays) {
  FrictionNetwork::Shape shape;
  shape.layers = layers;
  shape.standing_mm = 0;
  shape.nodes = nodes;
  shape.line.delays = delays;
  return shape;
}

std::vector<double> some_weights(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> out(static_cast<std::size_t>(count));
  for (double& weight : out) weight = normal(random);
  return out;
}

// The same perceptron written out as sums.
double by_hand(const FrictionNetwork::Shape& s, const std::vector<double>& w, std::vector<double> x) {
  std::size_t at = 0;
  for (int layer = 0; layer <= s.layers; ++layer) {
    const std::size_t rows = layer < s.layers ? static_cast<std::size_t>(s.nodes) : 1, width = x.size();
    std::vector<double> y(rows);
    for (std::size_t r = 0; r < rows; ++r) {
      y[r] = w[at + rows * width + r];
      for (std::size_t c = 0; c < width; ++c) y[r] += w[at + c * rows + r] * x[c];
      if (layer < s.layers) y[r] = 1 / (1 + std::exp(-y[r]));
    }
    at += rows * (width + 1);
    x = y;
  }
  return x[0];
}

TEST(FrictionNetwork, EqualsThePerceptronWrittenOut) {
  for (const int layers : {1, 2})
    for (const int nodes : {1, 10, 16, 32})
      for (const int delays : {1, 2, 6}) {
        const FrictionNetwork::Shape shape = shape_of(layers, nodes, delays);
        const std::vector<double> weights = some_weights(shape.weight_count(), 7);
        const FrictionNetwork network(shape, weights);
        EXPECT_EQ(network.weights(), weights);
        DelayLine::Taps taps(delays + 1);
        for (int i = 0; i <= delays; ++i) taps[i] = std::sin(1.0 + i);
        const std::vector<double> x(taps.data(), taps.data() + taps.size());
        EXPECT_NEAR(network.perceptron_N(taps), by_hand(shape, weights, x), 1e-12);
      }
}

TEST(FrictionNetwork, KnowsWhereItWasTrained) {
  FrictionNetwork::Shape shape = shape_of(1, 4, 2);
  shape.position_scale_mm = 20;
  shape.travel_scale_mm = 0.1;
  const FrictionNetwork network(shape, some_weights(shape.weight_count(), 1));
  DelayLine::Taps taps(3);
  taps << 19, 0.09, -0.09;
  EXPECT_TRUE(network.evaluate(taps).known);
  taps[0] = 23;
  EXPECT_FALSE(network.evaluate(taps).known);
  taps << 0, 0.2, 0;
  EXPECT_FALSE(network.evaluate(taps).known);
  EXPECT_FALSE(FrictionNetwork().evaluate(taps).known);
}

TEST(FrictionNetwork, EvaluatesWithoutAllocation) {
  const FrictionNetwork::Shape shape = shape_of(2, 32, 6);
  const FrictionNetwork network(shape, some_weights(shape.weight_count(), 3));
  DelayLine::Taps taps(7);
  taps.setConstant(0.3);
  double sum = 0;
  const long before = allocation_count();
  for (int i = 0; i < 1000; ++i) sum += network.evaluate(taps).force_N;
  EXPECT_EQ(allocation_count(), before);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(FrictionNetwork, RefusesWhatDoesNotFit) {
  EXPECT_THROW(FrictionNetwork(shape_of(1, 4, 2), std::vector<double>(5)), std::invalid_argument);
  EXPECT_THROW(FrictionNetwork(shape_of(3, 4, 2), {}), std::invalid_argument);
  EXPECT_THROW(FrictionNetwork(shape_of(1, 33, 2), {}), std::invalid_argument);
}

TEST(DelayLine, GivesTheTravelFromTapToTap) {
  const DelayLine::Config line{3, 4};
  DelayLine::State state;
  DelayLine::Taps taps;
  const auto place = [](int k) { return 0.01 * k * k; };
  for (int k = 0; k < 100; ++k) DelayLine::step(place(k), state);
  DelayLine::read(line, place(99), state, taps);
  ASSERT_EQ(taps.size(), 4);
  EXPECT_DOUBLE_EQ(taps[0], place(99));
  for (int i = 1; i <= 3; ++i) EXPECT_NEAR(taps[i], place(99 - 4 * (i - 1)) - place(99 - 4 * i), 1e-12);
}

// Standing, the force is between those of creeping up and down; at the border it is that of creeping.
TEST(FrictionNetwork, TakesTheMiddleOfBothDirectionsAtRest) {
  FrictionNetwork::Shape shape = shape_of(1, 8, 2);
  shape.standing_mm = 0.1;
  const FrictionNetwork network(shape, some_weights(shape.weight_count(), 5));
  const auto at = [&](double travel) {
    DelayLine::Taps taps(3);
    taps << 0.4, travel, travel;
    return network.evaluate(taps).force_N;
  };
  EXPECT_NEAR(at(0), (at(0.1) + at(-0.1)) / 2, 1e-12);
  EXPECT_NEAR(at(0.0999999), at(0.1), 1e-6);
  EXPECT_NEAR(at(-0.0999999), at(-0.1), 1e-6);
}

TrainingSet synthetic(int samples, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-20, 20), travel(-0.05, 0.05);
  TrainingSet set;
  set.taps.resize(3, samples);
  set.force_N.resize(samples);
  for (int i = 0; i < samples; ++i) {
    set.taps.col(i) << place(random), travel(random), 0;
    set.taps(2, i) = set.taps(1, i);
    set.force_N[i] = 2 * std::tanh(200 * set.taps(1, i)) + std::sin(0.2 * set.taps(0, i)) - 0.5;
  }
  return set;
}

TEST(TrainNetwork, LearnsFrictionAndRippleThatItHasNotSeen) {
  TrainingRecord record;
  const FrictionNetwork network =
      train_network(shape_of(1, 10, 2), synthetic(1500, 1), synthetic(700, 2), {2, 60, 1}, record);
  const NetworkError unseen = network_error(network, synthetic(2000, 3));
  EXPECT_GT(unseen.explained, 0.99);
  EXPECT_NEAR(record.explained_validation, unseen.explained, 0.01);
  EXPECT_EQ(record.samples, 1500);
}

TEST(TrainNetwork, RefusesTooLittleData) {
  TrainingRecord record;
  EXPECT_THROW(train_network(shape_of(1, 16, 2), synthetic(100, 1), synthetic(10, 2), {}, record),
               std::invalid_argument);
}

class NetworkFile : public testing::Test {
 protected:
  NetworkFile() {
    for (std::size_t i = 0; i < 2; ++i) {
      const FrictionNetwork::Shape shape = shape_of(1, 5, 2);
      networks_.network[i] =
          FrictionNetwork(shape, some_weights(shape.weight_count(), 11 + static_cast<unsigned>(i)));
      networks_.record[i].method = "by hand";
      networks_.record[i].data = "none";
      networks_.record[i].innovation_rms_mm = 1e-4;
    }
    write_networks(path_, networks_);
  }
  std::string text() const {
    std::ifstream file(path_);
    std::stringstream all;
    all << file.rdbuf();
    return all.str();
  }
  std::string error_of(const std::string& changed) const {
    std::ofstream(path_) << changed;
    try {
      read_networks(path_);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  const std::string path_ = testing::TempDir() + "networks.toml";
  StageNetworks networks_;
};

TEST_F(NetworkFile, ComesBackToTheBit) {
  const StageNetworks read = read_networks(path_);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(read.network[i].weights(), networks_.network[i].weights());
}

TEST_F(NetworkFile, AChangedWeightIsNoticed) {
  std::string changed = text();
  const std::size_t digit = changed.find('.', changed.find("weights")) + 3;
  changed[digit] = changed[digit] == '5' ? '6' : '5';
  const std::string error = error_of(changed);
  EXPECT_NE(error.find("checksum"), std::string::npos) << error;
  EXPECT_NE(error.find("train again"), std::string::npos) << error;
}

TEST_F(NetworkFile, AMissingWeightIsNoticed) {
  std::string changed = text();
  const std::size_t from = changed.find("weights = [") + 11;
  changed.erase(from, changed.find(',', from) + 1 - from);
  EXPECT_NE(error_of(changed).find("this shape has 26"), std::string::npos);
}

}  // namespace
}  // namespace trn
