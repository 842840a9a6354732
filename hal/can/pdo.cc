#include "hal/can/pdo.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "hal/can/nmt.h"

namespace trn {

namespace {

constexpr int kBytes = 8, kFdBytes = 64, kPdoMax = 4;

const DictionaryEntry& mappable(const ObjectDictionary& dictionary, ObjectKey key, bool receive) {
  const DictionaryEntry* entry = dictionary.find(key);
  if (!entry)
    throw EdsError(fmt::format("{}:1: object {} is needed in a {} but the node does not have it",
                               dictionary.file, to_string(key), receive ? "RPDO" : "TPDO"));
  const bool legal =
      entry->mappable && bits_of(entry->type) != 0 && (receive ? entry->writable : entry->readable);
  if (!legal)
    throw EdsError(
        fmt::format("{}:{}: object {} '{}' cannot be mapped into a {}; PDOMapping=1, a fixed size and {} "
                    "access are needed",
                    dictionary.file, entry->line, to_string(key), entry->name, receive ? "RPDO" : "TPDO",
                    receive ? "write" : "read"));
  return *entry;
}

Pdo empty_pdo(int number, bool receive, int node, bool fd) {
  Pdo pdo;
  pdo.fd = fd;
  pdo.number = static_cast<std::uint16_t>(number);
  pdo.id = (receive ? cob::kRpdo1 : cob::kTpdo1) + 0x100u * pdo.number + static_cast<unsigned>(node);
  return pdo;
}

// What the data sheet has there; entries below 0x20 are gaps (CiA 301, 7.4.7.1).
Pdo fixed_pdo(const ObjectDictionary& dictionary, int number, bool receive, int node, bool fd) {
  const std::string name = fmt::format("{}PDO{}", receive ? 'R' : 'T', number + 1);
  const auto mapping = static_cast<std::uint16_t>((receive ? 0x1600 : 0x1A00) + number);
  const auto count = dictionary.integer({mapping, 0});
  if (!count || *count < 1 || *count > kFdBytes)
    throw EdsError(
        fmt::format("{}:1: {} is fixed, and {} does not tell how many objects it carries; leave it out of "
                    "fixed_pdos, or complete the EDS by the drive's manual",
                    dictionary.file, name, to_string(ObjectKey{mapping, 0})));
  Pdo pdo = empty_pdo(number, receive, node, fd);
  pdo.fixed = true;
  int byte = 0;
  for (std::uint8_t sub = 1; sub <= *count; ++sub) {
    const auto entry = static_cast<std::uint32_t>(dictionary.integer({mapping, sub}).value_or(0));
    const ObjectKey key{static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8)};
    const int bits = static_cast<int>(entry & 0xFF);
    if (bits == 0 || bits % 8 != 0 ||
        (key.index >= 0x20 && bits_of(mappable(dictionary, key, receive).type) != bits))
      throw EdsError(
          fmt::format("{}:1: {} is fixed, and {} = 0x{:08X} is no object of whole bytes; complete the EDS by "
                      "the drive's manual",
                      dictionary.file, name, to_string(ObjectKey{mapping, sub}), entry));
    pdo.fields.push_back({key, bits, byte});
    byte += bits / 8;
  }
  if (byte > (fd ? kFdBytes : kBytes))
    throw EdsError(fmt::format("{}:1: {} is fixed with {} bytes; {} are legal", dictionary.file, name, byte,
                               fd ? kFdBytes : kBytes));
  return pdo;
}

/// Those of the fixed ones that carry anything of what is wanted.
std::vector<Pdo> fixed_pdos(const ObjectDictionary& dictionary, const std::vector<ObjectKey>& objects,
                            bool receive, int node, bool fd, const PdoHabits& habits) {
  std::vector<Pdo> out;
  const auto wanted = [&](const PdoField& field) {
    return std::find(objects.begin(), objects.end(), field.key) != objects.end();
  };
  for (int number = 0; number < kPdoMax; ++number) {
    if (!habits.fixed(receive, number)) continue;
    const Pdo pdo = fixed_pdo(dictionary, number, receive, node, fd);
    if (std::none_of(pdo.fields.begin(), pdo.fields.end(), wanted)) continue;
    // What a TPDO has more is only heard. An RPDO would set it, to 0.
    for (const PdoField& field : pdo.fields)
      if (receive && field.key.index >= 0x20 && !wanted(field))
        throw EdsError(
            fmt::format("{}:1: RPDO{} is fixed and carries {} {}, which nothing here sets: it would be 0 for "
                        "ever. Another 'mode' may set it",
                        dictionary.file, number + 1, to_string(field.key), dictionary.name_of(field.key)));
    out.push_back(pdo);
  }
  return out;
}

}  // namespace

int Pdo::size() const TRN_RT { return fields.empty() ? 0 : fields.back().byte + fields.back().bits / 8; }

std::string_view to_string(PdoWrite write) {
  constexpr std::string_view kNames[] = {"off", "type", "clear", "map", "count", "on"};
  return kNames[static_cast<std::size_t>(write)];
}

std::vector<Pdo> plan_pdos(const ObjectDictionary& dictionary, const std::vector<ObjectKey>& objects,
                           bool receive, int node, bool fd, const PdoHabits& habits) {
  std::vector<Pdo> pdos, fixed = fixed_pdos(dictionary, objects, receive, node, fd, habits);
  int next = 0;
  for (const ObjectKey key : objects) {
    int number = 0;
    PdoField field;
    if (find_field(fixed, key, number, field)) continue;
    const int bits = bits_of(mappable(dictionary, key, receive).type);
    // In the order that was asked for, without looking for gaps: the first PDO is the fast one, and what
    // belongs to it must not slip behind.
    if (pdos.empty() || pdos.back().size() + bits / 8 > (fd ? kFdBytes : kBytes)) {
      while (habits.fixed(receive, next)) ++next;
      pdos.push_back(empty_pdo(next++, receive, node, fd));
    }
    const int byte = pdos.back().size();
    pdos.back().fields.push_back({key, bits, byte});
  }
  if (next > kPdoMax)
    throw EdsError(
        fmt::format("{}:1: the mapped objects need {} {} of a node beside {} fixed ones; 4 are legal",
                    dictionary.file, pdos.size(), receive ? "RPDOs" : "TPDOs", fixed.size()));
  pdos.insert(pdos.end(), fixed.begin(), fixed.end());
  std::sort(pdos.begin(), pdos.end(), [](const Pdo& a, const Pdo& b) { return a.number < b.number; });
  return pdos;
}

bool find_field(const std::vector<Pdo>& pdos, ObjectKey key, int& pdo, PdoField& field) {
  for (std::size_t i = 0; i < pdos.size(); ++i)
    for (const PdoField& candidate : pdos[i].fields) {
      if (candidate.key != key) continue;
      pdo = static_cast<int>(i);
      field = candidate;
      return true;
    }
  return false;
}

}  // namespace trn
