#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>

#include "app/session/session_log.h"
#include "interp/move.h"
#include "tests/fuzz/require.h"

// Fuzz target: any bytes as the log of a session. What is accepted is, written again, what stood there, and
// the same when it is read again; an error names file and line.
namespace {

using namespace trn;
using fuzz::require;
using Json = nlohmann::json;

constexpr const char* kFile = "fuzz.log";

// Logs of old have a fault's number, and a feature's predicted size follows from the others.
bool may_differ(const std::string& key, const Json& before) {
  return key == "predicted_mm" || (key == "fault" && before.is_number());
}

// Every value that is written stood there, or has its default because the log does not have it.
void judge_object(const Json& before, const Json& after) {
  for (const auto& [key, value] : after.items()) {
    if (!before.contains(key) || may_differ(key, before[key])) continue;
    if (key == "features") {
      require(before[key].size() == value.size(), "as many features");
      for (std::size_t i = 0; i < value.size(); ++i) judge_object(before[key][i], value[i]);
    } else {
      require(before[key] == value, "what was read of: " + before.dump() + " as: " + after.dump());
    }
  }
}

void judge(std::string_view text, const std::string& written) {
  std::istringstream before{std::string(text)}, after(written);
  for (std::string read, again; std::getline(before, read);) {
    require(static_cast<bool>(std::getline(after, again)), "as many lines");
    judge_object(Json::parse(read), Json::parse(again));
  }
  require(session_text(parse_session(written, kFile)) == written, "the same again");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text = fuzz::text_of(data, size);
  std::string written;
  try {
    const Session session = parse_session(text, kFile);
    written = session_text(session);
    if (session.torn_line > 0) text = text.substr(0, text.rfind('\n') + 1);
  } catch (const ProgramError& error) {
    fuzz::require_place(error.what(), kFile);
    return 0;
  }
  judge(text, written);
  return 0;
}
