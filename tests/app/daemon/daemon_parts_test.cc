#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "app/client/daemon_place.h"
#include "app/daemon/process_lock.h"
#include "app/daemon/realtime.h"
#include "app/daemon/reply_cache.h"
#include "app/session/realtime_config.h"
#include "app/session/session_log.h"
#include "core/config.h"
#include "hal/lcm_link.h"

namespace trn {
namespace {

mode_t current_umask() {
  const mode_t mask = umask(0);
  umask(mask);
  return mask;
}

trunnion::command_t command(std::int64_t client, std::int32_t sequence) {
  trunnion::command_t out{};
  out.client = client;
  out.sequence = sequence;
  return out;
}

trunnion::acknowledge_t answer(std::int64_t client, std::int32_t sequence, std::int8_t outcome) {
  trunnion::acknowledge_t out{};
  out.client = client;
  out.sequence = sequence;
  out.outcome = outcome;
  return out;
}

TEST(ReplyCache, RemembersTheLatestAnswerOfEachCommand) {
  ReplyCache replies;
  EXPECT_EQ(replies.find(1000, command(7, 1)), nullptr);
  replies.enter(1000, answer(7, 1, trunnion::acknowledge_t::WORKING));
  replies.enter(1000, answer(7, 1, trunnion::acknowledge_t::ACCEPTED));
  ASSERT_NE(replies.find(1000, command(7, 1)), nullptr);
  EXPECT_EQ(replies.find(1000, command(7, 1))->outcome, +trunnion::acknowledge_t::ACCEPTED);
  EXPECT_EQ(replies.find(1000, command(7, 2)), nullptr);
  EXPECT_EQ(replies.find(1000, command(8, 1)), nullptr) << "another client's count is its own";
  EXPECT_EQ(replies.find(1001, command(7, 1)), nullptr) << "another user's client is another";
}

TEST(ReplyCache, IsBounded) {
  ReplyCache replies;
  const int n = static_cast<int>(ReplyCache::kCapacity);
  for (int i = 0; i < n + 10; ++i) replies.enter(1000, answer(1, i, trunnion::acknowledge_t::ACCEPTED));
  EXPECT_EQ(replies.find(1000, command(1, 9)), nullptr);
  EXPECT_NE(replies.find(1000, command(1, 10)), nullptr);
  EXPECT_NE(replies.find(1000, command(1, n + 9)), nullptr);
}

// As `load` of a large program, in a flood of other commands.
TEST(ReplyCache, WhatIsWorkedAtIsNotForgotten) {
  ReplyCache replies;
  const int n = static_cast<int>(ReplyCache::kCapacity);
  replies.enter(1000, answer(7, 1, trunnion::acknowledge_t::WORKING));
  for (int i = 0; i < 3 * n; ++i) replies.enter(1000, answer(1, i, trunnion::acknowledge_t::ACCEPTED));
  ASSERT_NE(replies.find(1000, command(7, 1)), nullptr);
  EXPECT_EQ(replies.find(1000, command(7, 1))->outcome, +trunnion::acknowledge_t::WORKING);
  replies.enter(1000, answer(7, 1, trunnion::acknowledge_t::FAULT));
  for (int i = 0; i < n - 1; ++i) replies.enter(1000, answer(2, i, trunnion::acknowledge_t::ACCEPTED));
  ASSERT_NE(replies.find(1000, command(7, 1)), nullptr) << "its answer is as young as it is";
  EXPECT_EQ(replies.find(1000, command(7, 1))->outcome, +trunnion::acknowledge_t::FAULT);
  replies.enter(1000, answer(3, 1, trunnion::acknowledge_t::ACCEPTED));
  EXPECT_EQ(replies.find(1000, command(7, 1)), nullptr);
}

TEST(ProcessLock, RefusesASecondProcessAndNamesTheFirst) {
  const std::string machine = "lock-test-" + std::to_string(getpid());
  const ProcessLock lock(machine);
  try {
    const ProcessLock second(machine);
    FAIL() << "two holders";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("process " + std::to_string(getpid())), std::string::npos)
        << error.what();
  }
}

TEST(ProcessLock, IsFreedByTheKernelWhenItsProcessIsKilled) {
  const std::string machine = "lock-kill-" + std::to_string(getpid());
  const pid_t child = fork();
  if (child == 0) {
    const ProcessLock lock(machine);
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_NO_THROW(ProcessLock(std::string(machine)));
}

/// A folder of the test's own, gone with it.
class Folder {
 public:
  Folder() {
    std::string name = ::testing::TempDir() + "doors-XXXXXX";
    path = mkdtemp(name.data());
  }
  ~Folder() { std::filesystem::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string path;
};

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ProcessLock, FollowsNoLinkAndWritesNoForeignFile) {
  const Folder folder;
  const std::string victim = folder.path + "/victim", lock = folder.path + "/trunnion-m.lock";
  std::ofstream(victim) << "precious";
  std::filesystem::create_symlink(victim, lock);
  EXPECT_THROW(ProcessLock("m", {folder.path}), std::runtime_error);
  std::filesystem::remove(lock);
  std::filesystem::create_hard_link(victim, lock);
  EXPECT_THROW(ProcessLock("m", {folder.path}), std::runtime_error);
  std::filesystem::remove(lock);
  ASSERT_EQ(mkfifo(lock.c_str(), 0600), 0);
  EXPECT_THROW(ProcessLock("m", {folder.path}), std::runtime_error);
  EXPECT_EQ(text_of(victim), "precious");
}

TEST(ProcessLock, TakesOnlyAFolderThatNobodyElseCanWrite) {
  const Folder folder;
  const std::string open = folder.path + "/open", link = folder.path + "/link", own = folder.path + "/own";
  std::filesystem::create_directory(open);
  std::filesystem::permissions(open, std::filesystem::perms::all);
  std::filesystem::create_directory_symlink(open, link);
  EXPECT_EQ(private_folder({"/nonexistent/x/y", open, link, own}), own);
  EXPECT_THROW(private_folder({open, link}), std::runtime_error);
  const ProcessLock lock("m", {open, own});
  struct stat info {};
  ASSERT_EQ(stat((own + "/trunnion-m.lock").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777u, 0640u & ~current_umask());
  EXPECT_THROW(ProcessLock("m", {own}), std::runtime_error) << "held";
}

TEST(ProcessLock, TrustsRootAndItself) {
  EXPECT_TRUE(is_trusted_user(0));
  EXPECT_TRUE(is_trusted_user(geteuid()));
  EXPECT_FALSE(is_trusted_user(65534));
}

TEST(SessionLog, IsNeverWrittenOver) {
  const Folder folder;
  const std::string path = folder.path + "/log";
  EXPECT_EQ(make_log_file(path), path);
  std::ofstream(path) << "a session";
  EXPECT_EQ(make_log_file(path), path + ".1");
  EXPECT_EQ(make_log_file(path), path + ".2");
  EXPECT_EQ(text_of(path), "a session");
  EXPECT_THROW(make_log_file(folder.path + "/none/log"), std::runtime_error);
}

TEST(SessionLog, KeepsWhatTheSessionBeganWith) {
  const Folder folder;
  const std::string path = make_log_file(folder.path + "/log");
  { const SessionLog log(path, {"m.toml", "t.tbl", "v.var", false, "T1 P1 Z+50\n", "5221\t5\n"}); }
  const SessionHead head = read_session(path).head;
  EXPECT_EQ(head.vars_text, "5221\t5\n");
  EXPECT_EQ(head.tools_text, "T1 P1 Z+50\n");
}

TEST(RunPeriodic, KeepsThePeriodAndLeavesMissedDeadlinesOut) {
  LoopStatistics statistics;
  std::vector<int> late;
  const auto begin = std::chrono::steady_clock::now();
  run_periodic(2'000'000, statistics, [&](int late_periods) {
    late.push_back(late_periods);
    if (late.size() == 10) std::this_thread::sleep_for(std::chrono::milliseconds(9));
    return late.size() < 50;
  });
  const auto took_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_EQ(statistics.periods.load(), 50u);
  EXPECT_GE(late[10], 4) << "9 ms are four deadlines of 2 ms";
  EXPECT_GE(statistics.overruns.load(), 4u);
  EXPECT_GE(took_ms, 2.0 * static_cast<double>(50 + statistics.overruns.load()) - 2.5);
}

TEST(RealtimeConfig, LatenessIsAFaultWithRealDrivesOrWhereTheConfigSaysSo) {
  const RealtimeConfig silent = read_realtime(parse_config("[realtime]\npriority = 50", "t"));
  EXPECT_EQ(silent.late_periods(true), 5);
  EXPECT_EQ(silent.late_periods(false), 0);
  const RealtimeConfig said = read_realtime(parse_config("[realtime]\nlate_periods_max = 9", "t"));
  EXPECT_EQ(said.late_periods(true), 9);
  EXPECT_EQ(said.late_periods(false), 9);
}

TEST(RealtimeConfig, IsStrictAndMayBeMissing) {
  EXPECT_EQ(read_realtime(parse_config("", "t")).priority, 80);
  const ConfigTable root = parse_config("[realtime]\npriority = 50\ncpu = 1\nlock_memory = false", "t");
  EXPECT_EQ(read_realtime(root).cpu, 1);
  EXPECT_NO_THROW(root.finish());
  EXPECT_THROW(read_realtime(parse_config("[realtime]\npriority = 99", "t")), ConfigError);
  const ConfigTable misspelt = parse_config("[realtime]\npriorty = 50", "t");
  read_realtime(misspelt);
  EXPECT_THROW(misspelt.finish(), ConfigError);
}

TEST(LcmConfig, IsStrictAndMayBeMissing) {
  EXPECT_EQ(read_lcm(parse_config("", "t"), "mill").command_channel(), "mill.command");
  EXPECT_EQ(read_lcm(parse_config("[lcm]\nurl = \"memq://\"", "t"), "mill").url, "memq://");
  EXPECT_THROW(read_lcm(parse_config("[lcm]\nurl = 3", "t"), "mill"), ConfigError);
  EXPECT_THROW(read_lcm(parse_config("", "t"), "a/b"), ConfigError);
}

TEST(LcmLink, CarriesEveryMessageThereAndBack) {
  LcmLink link("memq://");
  std::optional<trunnion::command_t> heard;
  std::optional<trunnion::status_t> status;
  link.subscribe<trunnion::command_t>("c", [&](const auto& message) { heard = message; });
  link.subscribe<trunnion::status_t>("s", [&](const auto& message) { status = message; });
  trunnion::command_t sent = command(1234567890123456789, 42);
  sent.verb = trunnion::command_t::JOG;
  sent.joint = 3;
  sent.value = -0.1;
  sent.text = "G0 X1\nG0 X2";
  link.publish("c", sent);
  trunnion::status_t state{};
  state.state = "running";
  state.joint_count = 2;
  state.joint_name = {"X", "C"};
  state.joint_unit = {"mm", "rad"};
  state.joint_homed = {1, 0};
  state.joint_limit_switch = {0, 1};
  state.wake_us_p999 = 12.5;
  link.publish("s", state);
  while (link.handle(50)) {
  }
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->client, sent.client);
  EXPECT_EQ(heard->value, -0.1);
  EXPECT_EQ(heard->text, sent.text);
  ASSERT_TRUE(status);
  EXPECT_EQ(status->joint_name[1], "C");
  EXPECT_EQ(status->joint_homed[0], 1);
  EXPECT_EQ(status->wake_us_p999, 12.5);
}

TEST(LcmLink, DropsWhatIsNotTheMessage) {
  LcmLink link("memq://");
  int heard = 0;
  link.subscribe<trunnion::command_t>("c", [&](const auto&) { ++heard; });
  link.publish("c", answer(1, 1, 1));
  link.publish("c", command(1, 1));
  while (link.handle(50)) {
  }
  EXPECT_EQ(heard, 1);
}

TEST(LcmSelfTest, NamesAnUnusableGroup) {
  EXPECT_NE(lcm_self_test("udpm://host.example:7667?ttl=0").find("IPv4"), std::string::npos);
  EXPECT_EQ(lcm_self_test("memq://"), "");
}

}  // namespace
}  // namespace trn
