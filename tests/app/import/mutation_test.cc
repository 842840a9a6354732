#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "app/import/import_linuxcnc.h"
#include "app/import/import_place.h"
#include "app/session/assembly.h"
#include "core/config.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

namespace trn {
namespace {

using Texts = std::map<std::string, std::string>;

Texts test_machines() {
  Texts out;
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() + "/tests/app/import/machines")) {
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    out[entry.path().filename()] = text.str();
  }
  return out;
}

/// Damages texts as people, disks and editors do; the same seed damages in the same way.
class Damage {
 public:
  explicit Damage(unsigned seed) : random_(seed) {}

  void apply(std::string& text) {
    switch (below(7)) {
      case 0:
        return erase(text);
      case 1:
        return insert(text, text.substr(below(text.size() + 1), below(60)));
      case 2:
        return insert(text, std::string(1, static_cast<char>(below(256))));
      case 3:
        return insert(text, word());
      case 4:
        return replace_number(text);
      case 5:
        return line(text, true);
      default:
        return line(text, false);
    }
  }
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }

 private:
  void erase(std::string& text) { text.erase(below(text.size() + 1), 1 + below(40)); }
  void insert(std::string& text, const std::string& what) { text.insert(below(text.size() + 1), what); }
  void replace_number(std::string& text) {
    const std::size_t from = text.find_first_of("0123456789", below(text.size() + 1));
    if (from == std::string::npos) return;
    text.replace(from, text.find_first_not_of("0123456789.", from) - from, word());
  }
  void line(std::string& text, bool twice) {
    const std::size_t begin = text.rfind('\n', below(text.size() + 1)) + 1;
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    if (begin >= text.size()) return;
    const std::string one = text.substr(begin, end - begin);
    if (!twice) text.erase(begin, end - begin);
    if (twice) insert(text, one);
  }
  std::string word() {
    static const std::vector<std::string> kWords = {"[",
                                                    "]",
                                                    "=",
                                                    "\\\n",
                                                    "\n",
                                                    "#INCLUDE mill_inch.ini\n",
                                                    "1e999",
                                                    "nan",
                                                    "-",
                                                    "1e-320",
                                                    "-5e300",
                                                    "[KINS]KINEMATICS",
                                                    "setp ",
                                                    "net ",
                                                    "source xyzac.hal\n",
                                                    "\"",
                                                    "0",
                                                    "999999999999999999999",
                                                    "coordinates=XYZABCUVW",
                                                    "ANGULAR",
                                                    "LINEAR",
                                                    "inch",
                                                    "genhexkins",
                                                    "5axiskins",
                                                    "scarakins",
                                                    "xyzac-trt-kins",
                                                    "HALFILE = xyzbc.hal\n",
                                                    "[JOINT_0]\n",
                                                    "\xff\xfe",
                                                    "\t",
                                                    "T1 P1 Z1 Z2\n"};
    const std::size_t chosen = below(kWords.size() + 1);
    return chosen < kWords.size() ? kWords[chosen] : std::string(3000, 'x');
  }
  std::mt19937 random_;
};

/// "file:line:column: message", of one of the files.
bool has_place(const std::string& message, const Texts& texts) {
  for (const auto& [name, text] : texts) {
    if (!message.starts_with(name + ":")) continue;
    std::istringstream rest(message.substr(name.size() + 1));
    int line = 0, column = 0;
    char colon = 0, second = 0;
    if (rest >> line >> colon >> column >> second && line >= 1 && column >= 1 && colon == ':' &&
        second == ':')
      return true;
  }
  return false;
}

struct Outcomes {
  int imported = 0, refused = 0, errors = 0, illegal = 0;
};

void judge(const ConfigTable& config, Outcomes& outcomes) {
  try {
    assemble(config);
  } catch (const ConfigError&) {  // the command refuses such a machine
    ++outcomes.illegal;
  }
}

void try_one(const std::string& ini, const Texts& texts, Outcomes& outcomes) {
  const ImportReader read = [&](const std::string& path) -> std::optional<std::string> {
    const auto found = texts.find(path);
    return found == texts.end() ? std::nullopt : std::optional(found->second);
  };
  try {
    const ImportedFiles files = import_linuxcnc(ini, read, "/nowhere/");
    ++outcomes.imported;
    import_json(files).dump();
    std::optional<ConfigTable> config;
    ASSERT_NO_THROW(config = parse_config(files.config, "config")) << files.config;
    judge(*config, outcomes);
  } catch (const ImportError& error) {
    ++outcomes.errors;
    EXPECT_TRUE(has_place(error.what(), texts)) << error.what();
  } catch (const ImportRefusal& error) {
    ++outcomes.refused;
    EXPECT_TRUE(has_place(error.what(), texts)) << error.what();
  }
}

TEST(Mutations, EveryTextIsImportedOrRefusedWithItsPlace) {
  const int count = test::rounds(2000);
  const Texts whole = test_machines();
  std::vector<std::string> machines, names;
  for (const auto& [name, text] : whole) {
    names.push_back(name);
    if (name.ends_with(".ini")) machines.push_back(name);
  }
  ASSERT_GE(machines.size(), 6u);
  Outcomes outcomes;
  for (int seed = 0; seed < count && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Damage damage(static_cast<unsigned>(seed));
    Texts texts = whole;
    const std::string& ini = machines[damage.below(machines.size())];
    const std::size_t times = 1 + damage.below(4);
    for (std::size_t i = 0; i < times; ++i) {
      // Most damage goes to the INI itself and to files of its name.
      std::string name = damage.below(3) > 0 ? ini : names[damage.below(names.size())];
      const std::string hal = ini.substr(0, ini.size() - 4) + ".hal";
      if (damage.below(4) == 0 && texts.contains(hal)) name = hal;
      damage.apply(texts[name]);
    }
    try_one(ini, texts, outcomes);
  }
  std::printf("%d texts: %d imported (of them %d no legal config), %d refused, %d errors\n", count,
              outcomes.imported, outcomes.illegal, outcomes.refused, outcomes.errors);
  EXPECT_GT(outcomes.imported, count / 5);
  EXPECT_GT(outcomes.errors, count / 10);
  EXPECT_GT(outcomes.refused, 0);
}

}  // namespace
}  // namespace trn
