#include "hal/can/pdo.h"

#include <fmt/format.h>

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

}  // namespace

int Pdo::size() const TRN_RT { return fields.empty() ? 0 : fields.back().byte + fields.back().bits / 8; }

std::vector<Pdo> plan_pdos(const ObjectDictionary& dictionary, const std::vector<ObjectKey>& objects,
                           bool receive, int node, bool fd) {
  std::vector<Pdo> pdos;
  for (const ObjectKey key : objects) {
    const int bits = bits_of(mappable(dictionary, key, receive).type);
    // In the order that was asked for, without looking for gaps: the first PDO is the fast one, and what
    // belongs to it must not slip behind.
    if (pdos.empty() || pdos.back().size() + bits / 8 > (fd ? kFdBytes : kBytes)) {
      Pdo pdo;
      pdo.fd = fd;
      pdo.number = static_cast<std::uint16_t>(pdos.size());
      pdo.id = (receive ? cob::kRpdo1 : cob::kTpdo1) + 0x100u * pdo.number + static_cast<unsigned>(node);
      pdos.push_back(pdo);
    }
    const int byte = pdos.back().size();
    pdos.back().fields.push_back({key, bits, byte});
  }
  if (pdos.size() > kPdoMax)
    throw EdsError(fmt::format("{}:1: the mapped objects fill {} PDOs of a node; 4 are legal",
                               dictionary.file, pdos.size()));
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
