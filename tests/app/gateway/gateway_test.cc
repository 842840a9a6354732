#include "app/gateway/gateway.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/client/command_rights.h"
#include "app/client/signed_message.h"
#include "app/client/signing_key.h"
#include "app/gateway/counter_file.h"
#include "hal/lcm_messages.h"
#include "hal/message_codec.h"

namespace trn {
namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::sensor_t;
using trunnion::signed_command_t;

SigningKey::Seed seed_of(std::uint8_t number) {
  SigningKey::Seed seed{};
  seed.fill(number);
  return seed;
}

command_t command_of(std::int8_t verb, std::int32_t sequence, std::int64_t client = 77) {
  command_t command{};
  command.verb = verb;
  command.sequence = sequence;
  command.client = client;
  command.expires_us = 1'000'000;
  command.value = 1;  // an override of 0 would make safe
  return command;
}

/// A gateway before a daemon that the test plays.
class GatewayTest : public testing::Test {
 protected:
  GatewayTest() {
    std::string name = testing::TempDir() + "gateway-XXXXXX";
    folder_ = mkdtemp(name.data());
    start();
  }
  ~GatewayTest() override { std::filesystem::remove_all(folder_); }

  void start() {
    gateway_.reset();
    counters_.reset();
    counters_ = std::make_unique<CounterFile>(folder_ + "/counters", "mill");
    gateway_ = std::make_unique<Gateway>(
        "mill",
        std::vector<Gateway::Key>{{"anna", anna_.public_key(), Role::kOperate},
                                  {"eve", eve_.public_key(), Role::kLook}},
        10, *counters_,
        Gateway::Outlets{[this](const command_t& command) {
                           commands_.push_back(command);
                           return reached_;
                         },
                         [this](const sensor_t& readings) {
                           readings_.push_back(readings);
                           return reached_;
                         },
                         [this](const acknowledge_t& answer) { answers_.push_back(answer); }});
  }
  signed_command_t of(const SigningKey& key, std::int64_t counter, const command_t& command) const {
    return sign_message(key, "mill", counter, signed_command_t::COMMAND, encode_inner(command));
  }
  void send(const signed_command_t& message, std::uint32_t from = 1) {
    gateway_->receive(message, {from, 1000}, now_);
    gateway_->hand_on();
  }
  std::uint64_t count(Refusal why) { return gateway_->refusals().count(why); }

  const SigningKey anna_{"anna", seed_of(1)}, eve_{"eve", seed_of(2)}, stranger_{"anna", seed_of(3)};
  Gateway::Clock::time_point now_{std::chrono::hours(1)};
  std::string folder_;
  std::unique_ptr<CounterFile> counters_;
  std::unique_ptr<Gateway> gateway_;
  bool reached_ = true;
  std::vector<command_t> commands_;
  std::vector<sensor_t> readings_;
  std::vector<acknowledge_t> answers_;
};

TEST_F(GatewayTest, ASignedCommandIsHandedOnOnceAndItsAnswerGoesBack) {
  send(of(anna_, 5, command_of(command_t::START, 3)));
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_EQ(commands_[0].verb, +command_t::START);
  acknowledge_t answer{};
  answer.client = commands_[0].client;
  answer.sequence = 3;
  answer.outcome = acknowledge_t::ACCEPTED;
  gateway_->answered(answer);
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_EQ(answers_[0].client, 77) << "as the client knows itself";
  // The same datagram once more: answered again, and not handed on again.
  send(of(anna_, 5, command_of(command_t::START, 3)));
  EXPECT_EQ(commands_.size(), 1u);
  EXPECT_EQ(answers_.size(), 2u);
}

TEST_F(GatewayTest, NothingElseComesIn) {
  signed_command_t message = of(anna_, 5, command_of(command_t::START, 1));
  send(sign_message(anna_, "lathe", 5, signed_command_t::COMMAND,
                    encode_inner(command_of(command_t::START, 1))));
  EXPECT_EQ(count(Refusal::kFalseSignature), 1u) << "of another machine";
  send(of(stranger_, 5, command_of(command_t::START, 1)));
  EXPECT_EQ(count(Refusal::kFalseSignature), 2u) << "of another key";
  for (std::size_t at = 0; at < message.inner.size(); ++at) {
    signed_command_t changed = message;
    changed.inner[at] ^= 1;
    send(changed, static_cast<std::uint32_t>(10 + at));
  }
  EXPECT_EQ(count(Refusal::kFalseSignature), 2 + message.inner.size());
  message.key = std::string("nobody");
  send(message);
  EXPECT_EQ(count(Refusal::kUnknownKey), 1u);
  send(sign_message(anna_, "mill", 6, signed_command_t::COMMAND, {1, 2, 3}));
  send(sign_message(anna_, "mill", 7, 9, encode_inner(command_of(command_t::START, 1))));
  EXPECT_EQ(count(Refusal::kNoMessage), 2u);
  command_t eternal = command_of(command_t::START, 4);
  eternal.expires_us = 0;
  send(of(anna_, 8, eternal));
  EXPECT_EQ(count(Refusal::kNoExpiry), 1u);
  EXPECT_TRUE(commands_.empty());
}

// Who listens may send again what he heard, also after the gateway has begun anew.
TEST_F(GatewayTest, AnOldCounterIsRefusedAlsoByTheNextGateway) {
  const signed_command_t heard = of(anna_, 5, command_of(command_t::JOG, 1));
  send(heard);
  start();
  send(heard);
  send(of(anna_, 4, command_of(command_t::JOG, 2)));
  EXPECT_EQ(commands_.size(), 1u);
  EXPECT_EQ(count(Refusal::kOldCounter), 2u);
  send(of(anna_, 6, command_of(command_t::JOG, 2)));
  EXPECT_EQ(commands_.size(), 2u);
}

TEST_F(GatewayTest, AKeyDoesWhatItsRoleMayAndEachMayStop) {
  send(of(eve_, 1, command_of(command_t::START, 1)));
  send(of(anna_, 1, command_of(command_t::CORRECTION, 1)));
  EXPECT_EQ(count(Refusal::kRole), 2u);
  ASSERT_EQ(answers_.size(), 2u);
  EXPECT_NE(answers_[0].message.find("role"), std::string::npos);
  EXPECT_TRUE(commands_.empty());
  for (const std::int8_t verb : {command_t::HOLD, command_t::STOP, command_t::ESTOP}) {
    send(of(eve_, 10 + verb, command_of(verb, verb)));
    ASSERT_FALSE(commands_.empty());
    EXPECT_EQ(commands_.back().verb, verb);
  }
  send(sign_message(eve_, "mill", 30, signed_command_t::SENSOR, encode_inner(sensor_t{})));
  EXPECT_TRUE(readings_.empty());
  send(sign_message(anna_, "mill", 30, signed_command_t::SENSOR, encode_inner(sensor_t{})));
  EXPECT_EQ(readings_.size(), 1u);
}

// The daemon answers a pair (client, sequence) once. A key that took another one's numbers would swallow his
// emergency stop.
TEST_F(GatewayTest, AKeyCannotSpendTheNumbersOfAnothersClient) {
  send(of(eve_, 1, command_of(command_t::STOP, 9, 77)));
  send(of(anna_, 1, command_of(command_t::ESTOP, 9, 77)));
  ASSERT_EQ(commands_.size(), 2u);
  EXPECT_NE(commands_[0].client, commands_[1].client);
  // And an answer to the one is none to the other.
  acknowledge_t answer{};
  answer.client = commands_[0].client;
  answer.sequence = 9;
  gateway_->answered(answer);
  EXPECT_EQ(answers_.size(), 1u);
}

TEST_F(GatewayTest, AFloodOfOneKeyIsCutButWhatMakesSafePasses) {
  for (int i = 1; i <= 100; ++i) send(of(anna_, i, command_of(command_t::OVERRIDE, i)));
  EXPECT_EQ(commands_.size(), 10u) << "at once";
  EXPECT_EQ(count(Refusal::kRate), 90u);
  send(of(anna_, 101, command_of(command_t::ESTOP, 101)));
  EXPECT_EQ(commands_.back().verb, +command_t::ESTOP);
  send(of(eve_, 1, command_of(command_t::HOLD, 1)));
  EXPECT_EQ(commands_.back().verb, +command_t::HOLD);
  now_ += std::chrono::seconds(1);
  send(of(anna_, 102, command_of(command_t::OVERRIDE, 102)));
  EXPECT_EQ(commands_.back().sequence, 102);
}

// The daemon may have acted on the first copy, so that 'refused' would be untrue.
TEST_F(GatewayTest, ACommandThatIsAskedForAgainTooOftenIsNotCalledRefused) {
  for (int i = 1; i <= 30; ++i) send(of(anna_, i, command_of(command_t::START, 1)));
  EXPECT_EQ(commands_.size(), 10u);
  EXPECT_TRUE(answers_.empty());
}

TEST_F(GatewayTest, AHostOfManyFalseSignaturesIsNotLookedAtAndOthersAre) {
  const signed_command_t untrue = of(stranger_, 5, command_of(command_t::START, 1));
  for (int i = 0; i < 1000; ++i) send(untrue, 1);
  EXPECT_EQ(count(Refusal::kFalseSignature), 100u);
  EXPECT_EQ(count(Refusal::kTooManyFalse), 900u);
  send(of(anna_, 6, command_of(command_t::ESTOP, 1)), 2);
  EXPECT_EQ(commands_.size(), 1u);
}

TEST_F(GatewayTest, WithoutCountersOnDiskOnlyWhatMakesSafePasses) {
  std::filesystem::remove_all(folder_);
  send(of(anna_, 1, command_of(command_t::START, 1)));
  EXPECT_TRUE(commands_.empty());
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_NE(answers_[0].message.find("counters"), std::string::npos) << answers_[0].message;
  send(of(anna_, 2, command_of(command_t::ESTOP, 2)));
  EXPECT_EQ(commands_.size(), 1u);
}

TEST_F(GatewayTest, ADaemonThatIsNotThereIsTold) {
  reached_ = false;
  send(of(anna_, 1, command_of(command_t::START, 1)));
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_NE(answers_[0].message.find("no daemon"), std::string::npos);
}

}  // namespace
}  // namespace trn
