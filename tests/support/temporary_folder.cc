#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

namespace {

// What tests write lies in a folder of their own process: two programs on one host, or two parts of one, have
// files, links and pseudo-terminals of the same names, and would take them from each other.
class TemporaryFolder final : public testing::Environment {
 public:
  void SetUp() override {
    path_ = testing::TempDir() + "trunnion-XXXXXX";
    if (!mkdtemp(path_.data())) throw std::runtime_error("no folder can be made in " + testing::TempDir());
    chmod(path_.c_str(), 0755);  // other users look in, as they may in /tmp
    if (const char* before = std::getenv("TEST_TMPDIR")) before_ = before;
    setenv("TEST_TMPDIR", path_.c_str(), 1);
  }
  void TearDown() override {
    std::filesystem::remove_all(path_);
    if (before_)
      setenv("TEST_TMPDIR", before_->c_str(), 1);
    else
      unsetenv("TEST_TMPDIR");
  }

 private:
  std::string path_;
  std::optional<std::string> before_;
};

testing::Environment* const folder = testing::AddGlobalTestEnvironment(new TemporaryFolder);

}  // namespace
