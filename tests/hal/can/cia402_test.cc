#include "hal/can/cia402.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>

// CiA 402-2, 8.3 and 8.4: figure of the state machine, tables of the words.
namespace trn {
namespace {

using S = Cia402State;

constexpr S kStates[] = {S::kNotReady,         S::kSwitchOnDisabled, S::kReadyToSwitchOn,     S::kSwitchedOn,
                         S::kOperationEnabled, S::kQuickStopActive,  S::kFaultReactionActive, S::kFault};

TEST(Cia402, TheBitsOfAStateAreReadAsThatState) {
  for (const S state : kStates) {
    const std::uint16_t bits = cia402_status_bits(state);
    EXPECT_EQ(bits & ~0x6F, 0) << to_string(state);
    for (const unsigned rest : {0u, 0x0010u, 0x1680u})  // voltage; warning, remote, target reached, bit 12
      EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(bits | rest)), state) << to_string(state);
  }
}

// What a drive does with a controlword, by the table of commands: bit pattern and transition.
S obey(S state, unsigned word) {
  if ((word & 0x82) == 0) return state == S::kFault || state == S::kNotReady ? state : S::kSwitchOnDisabled;
  if ((word & 0x87) == 0x06) return state == S::kSwitchOnDisabled ? S::kReadyToSwitchOn : state;
  if ((word & 0x8F) == 0x07) return state == S::kReadyToSwitchOn ? S::kSwitchedOn : state;
  if ((word & 0x8F) == 0x0F) return state == S::kSwitchedOn ? S::kOperationEnabled : state;
  return state;
}

TEST(Cia402, EveryCommandLeadsOneTransitionOn) {
  for (const auto& [from, to] :
       {std::pair{S::kSwitchOnDisabled, S::kReadyToSwitchOn}, std::pair{S::kReadyToSwitchOn, S::kSwitchedOn},
        std::pair{S::kSwitchedOn, S::kOperationEnabled},
        std::pair{S::kOperationEnabled, S::kOperationEnabled},
        std::pair{S::kQuickStopActive, S::kSwitchOnDisabled}})
    EXPECT_EQ(obey(from, controlword_towards_enabled(from)), to) << to_string(from);
  for (const S state : kStates)
    EXPECT_EQ(controlword_towards_enabled(state) & 0x80, 0) << "no fault is reset: " << to_string(state);
  EXPECT_EQ(obey(S::kFault, controlword_towards_enabled(S::kFault)), S::kFault);
}

TEST(Cia402, WordsAreTold) {
  EXPECT_EQ(describe_statusword(0x0637), "operation enabled, voltage enabled, remote, target reached");
  EXPECT_EQ(describe_statusword(0x0040), "switch on disabled");
  EXPECT_EQ(describe_statusword(0x0888), "fault, warning, internal limit");
  EXPECT_EQ(describe_statusword(0x3021),
            "ready to switch on, bit 12 (follows, homed, acknowledged), bit 13 (following or homing error)");
  const std::pair<std::uint16_t, std::string> rows[] = {
      {0x0000, "disable voltage"},
      {0x000D, "disable voltage"},
      {0x0002, "quick stop"},
      {0x000B, "quick stop"},
      {0x0006, "shutdown"},
      {0x0007, "switch on"},
      {0x000F, "enable operation"},
      {0x0080, "fault reset"},
      {0x008F, "fault reset"},
      {0x003F, "enable operation, bit 4 (start, new setpoint, enable interpolation), change at once"},
      {0x010F, "enable operation, halt"}};
  for (const auto& [word, text] : rows) EXPECT_EQ(describe_controlword(word), text) << word;
}

// Object 0x6060.
TEST(Cia402, ModesHaveTheirNumbers) {
  const std::pair<int, std::string> rows[] = {{0, "no mode"},
                                              {1, "profile position"},
                                              {3, "profile velocity"},
                                              {6, "homing"},
                                              {7, "interpolated position"},
                                              {8, "cyclic synchronous position"},
                                              {9, "cyclic synchronous velocity"},
                                              {5, "unknown mode"}};
  for (const auto& [number, text] : rows) EXPECT_EQ(to_string(static_cast<Cia402Mode>(number)), text);
}

}  // namespace
}  // namespace trn
