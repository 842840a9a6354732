#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>

#include "app/daemon/program_wire.h"
#include "tests/fuzz/require.h"

// Fuzz target: any bytes between the daemon and the process that reads its programs, which may have lost its
// mind. First byte even: a reply, which the daemon reads; odd: a call. What is accepted is the same when it
// is written and read again.
namespace {

using namespace trn;
using fuzz::require;

void read_reply(const std::string& packet) {
  const ProgramReply reply = decode_reply(packet);
  require(reply.kind <= ProgramReply::Kind::kMeasured, "a kind of reply that there is");
  if (reply.kind == ProgramReply::Kind::kTables) {
    const std::string again = encode(reply.tables);
    require(encode(decode_reply(again).tables) == again, "the same tables again");
    return;
  }
  const std::string written = encode(reply);
  require(encode(decode_reply(written)) == written, "the same reply again");
}

void read_call(const std::string& packet) {
  const ProgramCall call = decode_call(packet);
  require(call.kind <= ProgramCall::Kind::kStarts, "a kind of call that there is");
  require(call.q.allFinite(), "places are numbers");
  const std::string written = encode(call);
  require(encode(decode_call(written)) == written, "the same call again");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string packet(fuzz::text_of(data + 1, size - 1));
  try {
    data[0] % 2 == 0 ? read_reply(packet) : read_call(packet);
  } catch (const std::exception& refused) {
    require(std::string(refused.what()) != "", "a refusal says why");
  }
  return 0;
}
