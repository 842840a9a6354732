#include "app/session/feature_recorder.h"

#include <gtest/gtest.h>

#include "core/motion.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"

namespace trn {
namespace {

ProgramMove cut(std::uint32_t line, double length_mm) {
  ProgramMove move;
  move.kind = ProgramMove::Kind::kFeed;
  move.from.setZero();
  move.to.setZero();
  move.to[0] = length_mm;
  move.source.line = line;
  return move;
}

CycleReport period(std::uint32_t line, double bent_mm) {
  CycleReport report;
  report.on_path = true;
  report.line = line;
  report.tool_load.known = true;
  report.tool_load.deflection_mm = {0, bent_mm};
  return report;
}

CycleReport end_of_program() {
  CycleReport report;
  report.event.kind = QueueEvent::Kind::kProgramEnd;
  return report;
}

TEST(FeatureRecorder, TellsOfAProgramWhenItHasEnded) {
  FeatureRecorder recorder;
  recorder.begin();
  recorder.programmed(cut(3, 10));
  EXPECT_FALSE(recorder.report(period(3, 0.02)));
  EXPECT_FALSE(recorder.report(period(3, 0.04)));
  EXPECT_TRUE(recorder.last().empty()) << "not before its end";
  EXPECT_TRUE(recorder.report(end_of_program()));
  ASSERT_EQ(recorder.last().size(), 1u);
  EXPECT_EQ(recorder.last()[0].line, 3u);
  EXPECT_NEAR(recorder.last()[0].bending_mm, 0.03, 1e-15) << "the mean";
}

TEST(FeatureRecorder, NothingOfOneProgramIsInTheNext) {
  FeatureRecorder recorder;
  recorder.programmed(cut(3, 10));
  recorder.report(period(3, 0.02));
  recorder.begin();
  recorder.programmed(cut(3, 20));
  recorder.report(period(3, 0.06));
  EXPECT_TRUE(recorder.report(end_of_program()));
  ASSERT_EQ(recorder.last().size(), 1u);
  EXPECT_EQ(recorder.last()[0].size_mm, 20);
  EXPECT_NEAR(recorder.last()[0].bending_mm, 0.06, 1e-15);
}

TEST(FeatureRecorder, ALineByHandLeavesWhatTheLastPartWasLike) {
  FeatureRecorder recorder;
  recorder.programmed(cut(3, 10));
  recorder.report(period(3, 0.02));
  recorder.report(end_of_program());
  recorder.begin();
  EXPECT_FALSE(recorder.report(end_of_program()));
  EXPECT_EQ(recorder.last().size(), 1u);
}

}  // namespace
}  // namespace trn
