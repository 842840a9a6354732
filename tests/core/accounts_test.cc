#include "core/accounts.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace trn {
namespace {

/// Fields of a file like /etc/passwd, line by line.
std::vector<std::vector<std::string>> fields_of(const std::string& path) {
  std::vector<std::vector<std::string>> out;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream text(line);
    std::vector<std::string> fields;
    for (std::string field; std::getline(text, field, ':');) fields.push_back(field);
    if (fields.size() >= 3 && !fields[2].empty()) out.push_back(fields);  // "+::::::" asks elsewhere
  }
  return out;
}

std::map<uid_t, std::string> users() {
  std::map<uid_t, std::string> out;
  for (const auto& fields : fields_of("/etc/passwd"))
    out.emplace(static_cast<uid_t>(std::stoul(fields[2])), fields[0]);  // the first of a number counts
  return out;
}

TEST(Accounts, UsersAreThoseOfTheFileAndOthersTheirNumber) {
  const auto all = users();
  ASSERT_FALSE(all.empty());
  for (const auto& [uid, name] : all) EXPECT_EQ(user_name(uid), name);
  constexpr uid_t kNobodys = 3'987'654'321;
  ASSERT_EQ(all.count(kNobodys), 0u);
  EXPECT_EQ(user_name(kNobodys), "3987654321");
}

// A panel that shows several machines connects to each in a thread of its own.
TEST(Accounts, EveryThreadHearsOfTheUserThatItAsksFor) {
  const auto all = users();
  std::atomic<int> wrong = 0;
  const auto ask_often = [&](std::size_t first) {
    for (int i = 0; i < 20; ++i)
      for (std::size_t k = 0; k < all.size(); ++k) {
        const auto& [uid, name] =
            *std::next(all.begin(), static_cast<std::ptrdiff_t>((first + k) % all.size()));
        if (user_name(uid) != name) ++wrong;
      }
  };
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 4; ++i) threads.emplace_back(ask_often, i * all.size() / 4);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(Accounts, GroupsAreThoseOfTheFile) {
  for (const auto& fields : fields_of("/etc/group"))
    EXPECT_EQ(group_id(fields[0]), static_cast<gid_t>(std::stoul(fields[2]))) << fields[0];
  EXPECT_EQ(group_id("no group of this name"), std::nullopt);
  EXPECT_EQ(group_id(""), std::nullopt);
}

TEST(Accounts, TheHomeFolderIsTheUsersWhateverTheEnvironmentSays) {
  for (const auto& fields : fields_of("/etc/passwd"))
    if (fields.size() >= 6 && fields[2] == std::to_string(geteuid())) {
      EXPECT_EQ(home_folder(), fields[5]);
      break;  // the first of a number counts
    }
}

}  // namespace
}  // namespace trn
