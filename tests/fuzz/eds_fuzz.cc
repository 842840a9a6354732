#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "hal/can/setup_steps.h"
#include "tests/fuzz/require.h"

// Fuzz target: any bytes as a data sheet. What is accepted has values of their types' lengths, and written
// out and read again it is the same; PDOs and the steps of the bring-up are planned with it or refused with a
// place.
namespace {

using namespace trn;
using fuzz::require;

constexpr const char* kFile = "fuzz.eds";
constexpr int kNode = 5;

bool is_real(DataType type) { return type == DataType::kReal32 || type == DataType::kReal64; }

std::string section_of(ObjectKey key, const DictionaryEntry& entry) {
  std::string text = fmt::format("[{:04X}sub{:X}]\nDataType=0x{:04X}\nAccessType={}\nPDOMapping={}\n",
                                 key.index, key.sub, static_cast<unsigned>(entry.type),
                                 !entry.writable  ? "ro"
                                 : entry.readable ? "rw"
                                                  : "wo",
                                 entry.mappable ? 1 : 0);
  if (entry.low) text += fmt::format("LowLimit={}\n", *entry.low);
  if (entry.high) text += fmt::format("HighLimit={}\n", *entry.high);
  text += fmt::format("DefaultValue={}\n", decode_integer(entry.type, entry.value));
  if (!entry.configured.empty())
    text += fmt::format("ParameterValue={}\n", decode_integer(entry.type, entry.configured));
  return text;
}

// Objects of whole numbers, whose values this can write.
void judge_round_trip(const ObjectDictionary& dictionary) {
  std::string text;
  for (const auto& [key, entry] : dictionary.entries)
    if (bits_of(entry.type) != 0 && !is_real(entry.type)) text += section_of(key, entry);
  if (text.empty()) return;
  const ObjectDictionary again = parse_eds(text, kFile, kNode);
  for (const auto& [key, entry] : again.entries) {
    const DictionaryEntry& first = dictionary.entries.at(key);
    require(entry.type == first.type && entry.mappable == first.mappable, "the type again");
    require(entry.writable == first.writable && entry.readable == first.readable, "the access again");
    require(entry.value == first.value && entry.configured == first.configured, "the value again");
    require(entry.low == first.low && entry.high == first.high, "the limits again");
  }
}

void judge(const ObjectDictionary& dictionary) {
  require(!dictionary.node_id || (*dictionary.node_id >= 1 && *dictionary.node_id <= 127), "a node's id");
  for (const auto& [key, entry] : dictionary.entries) {
    const auto bytes = static_cast<std::size_t>(bits_of(entry.type) / 8);
    if (bytes == 0) continue;
    require(entry.value.size() == bytes, "a value as long as its type");
    require(entry.configured.empty() || entry.configured.size() == bytes, "a configured value too");
    require(is_real(entry.type) || dictionary.integer(key).has_value(), "a whole number");
  }
  for (const std::string& warning : dictionary.warnings) fuzz::require_place(warning, kFile);
  judge_round_trip(dictionary);
}

void plan(const ObjectDictionary& dictionary) {
  constexpr ObjectKey kOut[] = {{0x6040, 0}, {0x607A, 0}, {0x6060, 0}};
  constexpr ObjectKey kIn[] = {{0x6041, 0}, {0x6064, 0}, {0x6061, 0}};
  try {
    const auto rpdos = plan_pdos(dictionary, {std::begin(kOut), std::end(kOut)}, true, kNode);
    const auto tpdos = plan_pdos(dictionary, {std::begin(kIn), std::end(kIn)}, false, kNode);
    for (const Pdo& pdo : rpdos) require(pdo.size() >= 1 && pdo.size() <= 8, "a PDO of one to eight bytes");
    DriveSetup setup;
    setup.period_s = 0.001;
    setup.heartbeat_ms = 100;
    setup.heartbeat_timeout_ms = 300;
    setup_steps(setup, dictionary, rpdos, tpdos);
  } catch (const EdsError& error) {
    fuzz::require_place(error.what(), kFile);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const ObjectDictionary dictionary = parse_eds(fuzz::text_of(data, size), kFile, kNode);
    judge(dictionary);
    plan(dictionary);
  } catch (const EdsError& error) {
    fuzz::require_place(error.what(), kFile);
  }
  return 0;
}
