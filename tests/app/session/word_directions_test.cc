#include "app/session/word_directions.h"

#include <gtest/gtest.h>

#include <string>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

std::string told(const std::string& machine, int word) {
  const Assembly assembly = assemble(source_dir() + "/configs/" + machine + ".toml");
  for (const WordDirection& direction : word_directions(*assembly.kinematics, Words::Zero()))
    if (direction.word == word) return describe(direction, assembly.machine);
  return "no such word";
}

// A mill's joints are its words; a cradle's table turns the work, so that the tool turns the other way about
// it.
TEST(WordDirections, SayWhatTheToolDoesAndWhichJointMoves) {
  EXPECT_EQ(told("mill", kX), "the tool goes towards +X of the work (joint +X)");
  EXPECT_EQ(told("mill", kY), "the tool goes towards +Y of the work (joint -Y)");
  EXPECT_EQ(told("mill", kZ), "the tool goes towards +Z of the work (joint +Z)");
  EXPECT_EQ(told("mill", kA), "no such word");
}

TEST(WordDirections, OfTheMillAreThoseOfISO841) {
  const Assembly assembly = assemble(source_dir() + "/configs/mill.toml");
  auto directions = word_directions(*assembly.kinematics, Words::Zero());
  ASSERT_EQ(directions.size(), 3u);
  for (WordDirection& direction : directions) {
    EXPECT_TRUE(direction.as_iso_841()) << direction.word;
    direction.tip = -direction.tip;
    EXPECT_FALSE(direction.as_iso_841()) << direction.word;
  }
}

TEST(WordDirections, WhereTheMachineCannotGoNothingIsKnown) {
  WordDirection nowhere;
  const Assembly assembly = assemble(source_dir() + "/configs/mill.toml");
  EXPECT_EQ(describe(nowhere, assembly.machine), "the machine cannot go there");
  Words far = Words::Zero();
  far[kX] = 1e5;
  const Assembly hexapod = assemble(source_dir() + "/configs/hexapod.toml");
  for (const WordDirection& direction : word_directions(*hexapod.kinematics, far))
    EXPECT_FALSE(direction.known) << direction.word;
}

}  // namespace
}  // namespace trn
