#include "core/time_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace trn {
namespace {

// The percentile is the upper edge of a quarter-octave bucket: never below the truth, at most a quarter above
// it.
TEST(TimeHistogram, PercentilesBoundTheTruthFromAbove) {
  TimeHistogram histogram;
  std::mt19937 random(3);
  std::lognormal_distribution<double> latency_us(3, 1.5);
  std::vector<double> truth;
  for (int i = 0; i < 20000; ++i) {
    truth.push_back(std::max(1.0, latency_us(random)));
    histogram.add(static_cast<std::int64_t>(truth.back() * 1000));
  }
  std::sort(truth.begin(), truth.end());
  for (const double share : {0.1, 0.5, 0.9, 0.99, 0.999}) {
    const double exact = truth[static_cast<std::size_t>(share * 20000) - 1];
    EXPECT_GE(histogram.percentile_us(share), exact * 0.999) << share;
    EXPECT_LE(histogram.percentile_us(share), exact * 1.2501) << share;
  }
  EXPECT_NEAR(histogram.max_us(), truth.back(), 0.001);
  EXPECT_EQ(TimeHistogram().percentile_us(0.5), 0);
}

TEST(TimeHistogram, BucketsHoldEveryDurationBelowTheirEdges) {
  EXPECT_TRUE(TimeHistogram().buckets().empty());
  TimeHistogram histogram;
  std::vector<double> truth;
  std::mt19937 random(5);
  std::lognormal_distribution<double> latency_us(4, 1);
  for (int i = 0; i < 5000; ++i) {
    truth.push_back(std::max(1.0, latency_us(random)));
    histogram.add(static_cast<std::int64_t>(truth.back() * 1000));
  }
  const std::vector<TimeHistogram::Bucket> buckets = histogram.buckets();
  ASSERT_GT(buckets.size(), 10u);
  EXPECT_GT(buckets.front().count, 0u);
  EXPECT_GT(buckets.back().count, 0u);
  std::uint64_t seen = 0;
  for (const TimeHistogram::Bucket& bucket : buckets) {
    seen += bucket.count;
    const auto below =
        std::count_if(truth.begin(), truth.end(), [&](double us) { return us < bucket.edge_us; });
    EXPECT_NEAR(static_cast<double>(seen), static_cast<double>(below), 2) << bucket.edge_us;
  }
  EXPECT_EQ(seen, truth.size());
}

TEST(TimeHistogram, HoldsEveryDuration) {
  TimeHistogram histogram;
  for (const std::int64_t ns :
       {std::int64_t{-5}, std::int64_t{0}, std::int64_t{999}, std::int64_t{3'000'000'000}})
    histogram.add(ns);
  EXPECT_GE(histogram.percentile_us(1.0), 1e6);
}

TEST(TimeHistogram, IsTrueUpToTwoSeconds) {
  for (const std::int64_t us : {1'500'000, 1'800'000, 1'900'000, 2'000'000}) {
    TimeHistogram histogram;
    histogram.add(1000 * us);
    EXPECT_EQ(histogram.percentile_us(0.5), static_cast<double>(us));
  }
}

}  // namespace
}  // namespace trn
