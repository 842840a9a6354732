#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "app/daemon/supervisor.h"

namespace trn {
namespace {

using S = MachineState;
using E = Event;

constexpr Conditions kReady{true, true, true};

const Transition* row(S from, E event) {
  for (const Transition& transition : Supervisor::table())
    if (transition.from == from && transition.event == event) return &transition;
  return nullptr;
}

std::vector<S> all_states() {
  std::vector<S> out;
  for (int i = 0; i < static_cast<int>(S::kCount); ++i) out.push_back(static_cast<S>(i));
  return out;
}

std::vector<E> all_events() {
  std::vector<E> out;
  for (int i = 0; i < static_cast<int>(E::kCount); ++i) out.push_back(static_cast<E>(i));
  return out;
}

/// A supervisor driven into every state by the events that lead there.
std::map<S, Supervisor> everywhere() {
  const std::map<S, std::vector<E>> ways = {{S::kOff, {}},
                                            {S::kStarting, {E::kReset}},
                                            {S::kIdle, {E::kReset, E::kDrivesReady}},
                                            {S::kRunning, {E::kReset, E::kDrivesReady, E::kStart}},
                                            {S::kHolding, {E::kReset, E::kDrivesReady, E::kStart, E::kHold}},
                                            {S::kStopping, {E::kReset, E::kDrivesReady, E::kStart, E::kStop}},
                                            {S::kJogging, {E::kReset, E::kDrivesReady, E::kJog}},
                                            {S::kHoming, {E::kReset, E::kDrivesReady, E::kHome}},
                                            {S::kFault, {E::kReset, E::kDrivesReady, E::kQuickFault}},
                                            {S::kEstop, {E::kEstop}},
                                            {S::kClosing, {E::kReset, E::kDrivesReady, E::kTerminate}}};
  std::map<S, Supervisor> out;
  for (const auto& [state, way] : ways) {
    Supervisor supervisor;
    for (const E event : way) EXPECT_EQ(supervisor.handle(event, kReady).refusal, "");
    EXPECT_EQ(supervisor.state(), state) << to_string(state);
    out[state] = supervisor;
  }
  return out;
}

// Which commands each state obeys, written down a second time, by hand.
TEST(Supervisor, ObeysExactlyTheseCommands) {
  const std::map<S, std::set<E>> legal = {
      {S::kOff, {E::kReset, E::kEstop, E::kTerminate}},
      {S::kStarting, {E::kEstop, E::kTerminate}},
      {S::kIdle,
       {E::kLoad, E::kStart, E::kMdi, E::kJog, E::kHome, E::kStop, E::kReset, E::kEstop, E::kTerminate}},
      {S::kRunning, {E::kHold, E::kResume, E::kStop, E::kEstop, E::kTerminate}},
      {S::kHolding, {E::kHold, E::kResume, E::kStart, E::kMdi, E::kJog, E::kStop, E::kEstop, E::kTerminate}},
      {S::kStopping, {E::kHold, E::kStop, E::kEstop, E::kTerminate}},
      {S::kJogging, {E::kJog, E::kHold, E::kStop, E::kEstop, E::kTerminate}},
      {S::kHoming, {E::kStop, E::kEstop, E::kTerminate}},
      {S::kFault, {E::kReset, E::kStop, E::kEstop, E::kTerminate}},
      {S::kEstop, {E::kReset, E::kStop, E::kEstop, E::kTerminate}},
      {S::kClosing, {E::kEstop, E::kTerminate}}};
  for (const auto& [state, supervisor] : everywhere())
    for (int i = 0; i < kCommandEvents; ++i) {
      const E event = static_cast<E>(i);
      Supervisor copy = supervisor;
      const Decision decision = copy.handle(event, kReady);
      EXPECT_EQ(decision.refusal.empty(), legal.at(state).count(event) == 1)
          << to_string(state) << " " << to_string(event) << ": " << decision.refusal;
      if (decision.refusal.empty()) continue;
      EXPECT_EQ(copy.state(), state) << "a refusal changes nothing";
      EXPECT_EQ(decision.actions, kDoNothing);
      EXPECT_NE(decision.refusal.find(to_string(state)), std::string::npos);
    }
}

// Every pair of state and event is either in the table, or changes nothing.
TEST(Supervisor, DoesWhatItsTableSaysAndNothingElse) {
  for (const auto& [state, supervisor] : everywhere())
    for (const E event : all_events()) {
      Supervisor copy = supervisor;
      const Decision decision = copy.handle(event, kReady);
      const Transition* entry = row(state, event);
      EXPECT_EQ(copy.state(), entry ? entry->to : state) << to_string(state) << " " << to_string(event);
      EXPECT_EQ(decision.actions, entry ? entry->actions : kDoNothing);
    }
}

TEST(Supervisor, TableNamesEachPairOnce) {
  std::set<std::pair<S, E>> seen;
  for (const Transition& transition : Supervisor::table())
    EXPECT_TRUE(seen.insert({transition.from, transition.event}).second)
        << to_string(transition.from) << " " << to_string(transition.event);
}

TEST(Supervisor, EmergencyStopIsObeyedEverywhereAndStopsTheDrives) {
  for (const auto& [state, supervisor] : everywhere()) {
    Supervisor copy = supervisor;
    const Decision decision = copy.handle(E::kEstop, {});
    EXPECT_TRUE(decision.actions & kDoQuickStop) << to_string(state);
    EXPECT_TRUE(copy.state() == S::kEstop || state == S::kClosing) << to_string(state);
  }
}

TEST(Supervisor, AfterAQuickFaultOnlyResetLeadsBack) {
  for (const auto& [state, supervisor] : everywhere()) {
    if (state == S::kEstop || state == S::kClosing) continue;
    Supervisor copy = supervisor;
    copy.handle(E::kQuickFault, kReady);
    ASSERT_EQ(copy.state(), S::kFault) << to_string(state);
    for (const E event : all_events()) {
      if (event == E::kReset || event == E::kEstop || event == E::kTerminate) continue;
      Supervisor next = copy;
      next.handle(event, kReady);
      EXPECT_EQ(next.state(), S::kFault) << to_string(event);
    }
  }
}

TEST(Supervisor, PathFaultStopsOnThePathAndGivesTheProgramUp) {
  for (const S state : {S::kRunning, S::kHolding, S::kJogging}) {
    const Transition* entry = row(state, E::kPathFault);
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(entry->to, S::kFault);
    EXPECT_EQ(entry->actions, kDoStopOnPath | kDoDropProgram);
  }
}

TEST(Supervisor, LeavesOnlyThroughRestAndDisabledDrives) {
  for (const auto& [state, supervisor] : everywhere()) {
    Supervisor copy = supervisor;
    EXPECT_FALSE(copy.handle(E::kTerminate, kReady).actions & (kDoExit | kDoShutDown)) << to_string(state);
    ASSERT_EQ(copy.state(), S::kClosing);
    EXPECT_EQ(copy.handle(E::kMotionDone, kReady).actions, kDoShutDown);
    EXPECT_EQ(copy.handle(E::kDrivesOff, kReady).actions, kDoExit);
    EXPECT_EQ(copy.state(), S::kOff);
  }
  const Transition* late = row(S::kClosing, E::kTimeout);
  ASSERT_NE(late, nullptr);
  EXPECT_TRUE(late->actions & kDoExit);
}

TEST(Supervisor, MotionNeedsAProgramAndKnownPositions) {
  const Supervisor idle = everywhere()[S::kIdle];
  Supervisor copy = idle;
  EXPECT_NE(copy.handle(E::kStart, {false, true}).refusal.find("load"), std::string::npos);
  EXPECT_NE(copy.handle(E::kStart, {true, false}).refusal.find("home"), std::string::npos);
  EXPECT_NE(copy.handle(E::kMdi, {false, false}).refusal.find("home"), std::string::npos);
  EXPECT_EQ(copy.handle(E::kJog, {false, false}).refusal, "")
      << "or nobody could clear a switch before homing";
  copy = idle;
  EXPECT_EQ(copy.handle(E::kMdi, {false, true}).actions, kDoMdi);
}

// Who is refused is told the state, where the command would be legal, and what leads there.
TEST(Supervisor, ARefusalSaysWhatHelps) {
  const std::map<S, std::string> help = {
      {S::kFault, "; clear it with 'reset'"},
      {S::kEstop, "; clear it with 'reset'"},
      {S::kOff, "; bring the drives up with 'reset'"},
      {S::kRunning, "; 'stop' ends what runs"},
      {S::kJogging, "; wait for its end, or 'stop' it"},
      {S::kHoming, "; wait for its end, or 'stop' it"},
      {S::kHolding, "; 'resume' or 'start' goes on, 'stop' gives the program up"}};
  for (auto& [state, supervisor] : everywhere()) {
    const std::string refusal = supervisor.handle(E::kHome, kReady).refusal;
    if (state == S::kIdle) {
      EXPECT_EQ(refusal, "");
      continue;
    }
    const auto found = help.find(state);
    EXPECT_EQ(refusal, "the machine is in state '" + std::string(to_string(state)) +
                           "'; 'home' is legal in: idle" + (found == help.end() ? "" : found->second));
    if (state != S::kRunning) continue;
    const std::string typed = supervisor.handle(E::kMdi, kReady).refusal;
    EXPECT_NE(typed.find("; 'hold' or 'stop' it first"), std::string::npos) << typed;
    // A jog along a direction is a typed line to the machine, and a jog to whoever asked for it.
    const std::string jog = supervisor.handle(E::kMdi, kReady, "jog").refusal;
    EXPECT_EQ(jog, typed.substr(0, typed.find("mdi")) + "jog" + typed.substr(typed.find("mdi") + 3));
  }
}

// While it still slows down, a jog would leave the path.
TEST(Supervisor, InAHoldItObeysJogsAndMdiOnceItStands) {
  for (const E event : {E::kJog, E::kMdi}) {
    Supervisor holding = everywhere()[S::kHolding];
    EXPECT_NE(holding.handle(event, {true, true, false}).refusal.find("does not stand yet"),
              std::string::npos);
    EXPECT_EQ(holding.handle(event, kReady).actions, event == E::kJog ? kDoJog : kDoMdi);
    EXPECT_EQ(holding.state(), S::kHolding) << "resume still leads back to the path";
  }
}

TEST(Supervisor, EveryStateCanBeReachedAndNamed) {
  std::set<std::string_view> names;
  for (const S state : all_states()) names.insert(to_string(state));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(S::kCount));
  EXPECT_EQ(everywhere().size(), static_cast<std::size_t>(S::kCount));
}

}  // namespace
}  // namespace trn
