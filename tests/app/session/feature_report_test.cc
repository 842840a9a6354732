#include "app/session/feature_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

namespace trn {
namespace {

FeatureDeflection feature(bool circle) {
  FeatureDeflection f;
  f.line = 7;
  f.last_line = circle ? 10 : 7;
  f.circle = circle;
  f.size_mm = 20;
  f.bending_mm = 0.0125;
  f.offset_mm = -0.0025;
  return f;
}

TEST(FeaturesText, TellsACircleByItsDiameterAndACutByItsOffset) {
  EXPECT_EQ(features_text({}), "");
  const std::string circle = features_text({feature(true)});
  EXPECT_NE(circle.find("lines 7-10 "), std::string::npos) << circle;
  EXPECT_NE(circle.find("circle   20.0000 mm   bends +0.0125 mm outward   predicted   19.9950 mm\n"),
            std::string::npos)
      << circle;
  const std::string cut = features_text({feature(false)});
  EXPECT_NE(cut.find("line 7 "), std::string::npos) << cut;
  EXPECT_NE(cut.find("cut      20.0000 mm   bends +0.0125 mm to the left   off by -0.0025 mm\n"),
            std::string::npos)
      << cut;
}

TEST(FeaturesText, SaysHowMuchIsUnknown) {
  FeatureDeflection f = feature(false);
  EXPECT_EQ(features_text({f}).find("unknown"), std::string::npos);
  f.unknown = 0.25;
  EXPECT_NE(features_text({f}).find("(25 % of it unknown)"), std::string::npos);
}

TEST(FeaturesText, ShowsTwentyAndCountsTheRest) {
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  const std::string all = features_text(std::vector<FeatureDeflection>(20, feature(true)));
  EXPECT_EQ(lines(all), 21) << "with a headline";
  EXPECT_EQ(all.find("more"), std::string::npos);
  const std::string some = features_text(std::vector<FeatureDeflection>(23, feature(true)), 4);
  EXPECT_EQ(lines(some), 22);
  EXPECT_TRUE(some.ends_with("    and 7 more\n")) << some;
}

TEST(FeaturesJson, HasTheDiameterThatIsPredicted) {
  const nlohmann::json json = features_json({feature(true), feature(false)});
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0]["feature"], "circle");
  EXPECT_EQ(json[1]["feature"], "cut");
  EXPECT_NEAR(json[0]["predicted_mm"].get<double>(), 19.995, 1e-12);
  EXPECT_NEAR(json[1]["predicted_mm"].get<double>(), 20, 1e-12);
}

}  // namespace
}  // namespace trn
