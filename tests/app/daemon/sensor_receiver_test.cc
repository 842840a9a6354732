#include "app/daemon/sensor_receiver.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>

#include "compensation/sensor_board.h"

namespace trn {
namespace {

trunnion::sensor_t readings(const std::vector<std::pair<std::string, double>>& named) {
  trunnion::sensor_t out{};
  for (const auto& [name, value] : named) {
    out.name.push_back(name);
    out.value.push_back(value);
  }
  out.count = static_cast<std::int32_t>(named.size());
  return out;
}

/// What the log says while this lives.
class HeardLog {
 public:
  HeardLog() : before_(spdlog::default_logger()) {
    const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(out_);
    const auto logger = std::make_shared<spdlog::logger>("heard", sink);
    logger->set_pattern("%v");
    spdlog::set_default_logger(logger);
  }
  ~HeardLog() { spdlog::set_default_logger(before_); }
  HeardLog(const HeardLog&) = delete;
  HeardLog& operator=(const HeardLog&) = delete;
  /// Since the last call.
  std::string text() {
    const std::string said = out_.str();
    out_.str(std::string());
    return said;
  }

 private:
  std::ostringstream out_;
  std::shared_ptr<spdlog::logger> before_;
};

TEST(ShownName, IsShortAndPrintable) {
  EXPECT_EQ(shown_name("box.x"), "box.x");
  EXPECT_EQ(shown_name(" ~"), " ~") << "the first and the last that can be printed";
  EXPECT_EQ(shown_name("a\x1b[2Jb\x7f\xc3\xa4\n"), "a?[2Jb????");
  EXPECT_EQ(shown_name(std::string(39, 'a')), std::string(39, 'a'));
  EXPECT_EQ(shown_name(std::string(100, 'a')), std::string(40, 'a'));
}

TEST(SensorReceiver, HandsEachReadingToItsChannel) {
  SensorBoard board;
  const int first = board.channel("t1"), second = board.channel("t2");
  SensorReceiver receiver(board);
  receiver.receive(readings({{"t2", 31.5}, {"t1", 20.25}}));
  SensorSample heard[2] = {board.listen(), board.listen()};
  if (heard[0].channel != first) std::swap(heard[0], heard[1]);
  EXPECT_EQ(heard[0].channel, first);
  EXPECT_EQ(heard[0].value, 20.25);
  EXPECT_EQ(heard[1].channel, second);
  EXPECT_EQ(heard[1].value, 31.5);
  EXPECT_EQ(board.listen().channel, -1) << "once";
}

TEST(SensorReceiver, TellsOfAStrangerOnce) {
  HeardLog log;
  SensorBoard board;
  board.channel("t1");
  board.channel("t2");
  SensorReceiver receiver(board);
  receiver.receive(readings({{"t\n", 1}, {"t1", 2}}));
  EXPECT_EQ(log.text(), "sensor 't?': no correction asks for it; they ask for: t1, t2\n");
  receiver.receive(readings({{"t\n", 1}}));
  EXPECT_EQ(log.text(), "");
  SensorBoard none;
  SensorReceiver deaf(none);
  deaf.receive(readings({{"t1", 1}}));
  EXPECT_EQ(log.text(), "sensor 't1': no correction asks for it; they ask for: none\n");
}

// Whoever sends ever new names fills neither the log nor the memory.
TEST(SensorReceiver, TellsOfAHundredStrangersAtMost) {
  HeardLog log;
  SensorBoard board;
  SensorReceiver receiver(board);
  for (int i = 0; i < 1000; ++i) receiver.receive(readings({{fmt::format("s{}", i), 0}}));
  const std::string said = log.text();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 100);
}

}  // namespace
}  // namespace trn
