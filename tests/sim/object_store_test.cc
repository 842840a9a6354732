#include "sim/canopen/object_store.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

// Rules of an object dictionary towards SDO: CiA 301, 7.2.4.3.17 (table 22) and 7.5.2.36.
namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string object(const std::string& section, int type, const std::string& access, const std::string& more) {
  return fmt::format("[{0}]\nParameterName=P{0}\nDataType={1}\nAccessType={2}\n{3}", section, type, access,
                     more);
}

// An RPDO and a TPDO with five places each; values of 16 bits to map, one that may not be, and a text.
ObjectStore make_store(int pdo_bytes = 8) {
  std::string text = object("1000", 7, "ro", "DefaultValue=0x20192\n");
  text += object("1005", 7, "rw", "DefaultValue=0x80\n");
  for (const char* record : {"1400", "1800", "1600", "1A00"})
    text += fmt::format("[{}]\nParameterName=R\nObjectType=9\nSubNumber=6\n", record);
  for (const char* record : {"1400", "1800"}) {
    text += object(fmt::format("{}sub0", record), 5, "ro", "DefaultValue=2\n");
    text += object(fmt::format("{}sub1", record), 7, "rw", "DefaultValue=0x80000181\n");
  }
  for (const char* record : {"1600", "1A00"}) {
    text += object(fmt::format("{}sub0", record), 5, "ro", "DefaultValue=0\n");
    for (int sub = 1; sub <= 5; ++sub)
      text += object(fmt::format("{}sub{}", record, sub), 7, "rw", "DefaultValue=0\n");
  }
  text += object("2000", 3, "rw", "DefaultValue=-5\nLowLimit=-100\nHighLimit=100\nPDOMapping=1\n");
  text += object("2001", 6, "wo", "DefaultValue=1\nPDOMapping=1\n");
  text += object("2002", 6, "ro", "DefaultValue=2\nPDOMapping=1\n");
  text += object("2003", 6, "rw", "DefaultValue=3\nPDOMapping=0\n");
  text += object("2005", 5, "rw", "DefaultValue=9\n");
  text += object("2004", 9, "rw", "DefaultValue=abc\n");
  return ObjectStore(parse_eds(text, "x.eds", 1), pdo_bytes);
}

Bytes le(std::uint32_t value, int size) {
  Bytes out;
  for (int i = 0; i < size; ++i) out.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  return out;
}

TEST(ObjectStore, ReadsWhatMayBeRead) {
  const ObjectStore store = make_store();
  Bytes bytes;
  EXPECT_EQ(store.read({0x2000, 0}, bytes), 0u);
  EXPECT_EQ(bytes, (Bytes{0xFB, 0xFF})) << "-5";
  EXPECT_EQ(store.integer({0x2000, 0}), -5);
  EXPECT_EQ(store.read({0x2004, 0}, bytes), 0u);
  EXPECT_EQ(bytes, (Bytes{'a', 'b', 'c'}));
  EXPECT_EQ(store.read({0x2001, 0}, bytes), 0x06010001u) << "write only";
  EXPECT_EQ(store.read({0x2010, 0}, bytes), 0x06020000u) << "no such object";
  EXPECT_EQ(store.read({0x2000, 1}, bytes), 0x06090011u) << "no such sub-index";
  EXPECT_EQ(store.integer({0x2010, 0}), 0);
}

TEST(ObjectStore, WritesWhatMayBeWritten) {
  ObjectStore store = make_store();
  EXPECT_EQ(store.write({0x2000, 0}, le(static_cast<std::uint32_t>(-100), 2)), 0u);
  EXPECT_EQ(store.integer({0x2000, 0}), -100);
  EXPECT_EQ(store.write({0x2000, 0}, le(100, 2)), 0u);
  EXPECT_EQ(store.write({0x2000, 0}, le(101, 2)), 0x06090031u) << "too high";
  EXPECT_EQ(store.write({0x2000, 0}, le(static_cast<std::uint32_t>(-101), 2)), 0x06090032u) << "too low";
  EXPECT_EQ(store.write({0x2000, 0}, le(1, 3)), 0x06070012u) << "too long";
  EXPECT_EQ(store.write({0x2000, 0}, le(1, 1)), 0x06070013u) << "too short";
  EXPECT_EQ(store.write({0x2005, 0}, Bytes{}), 0x06070013u) << "nothing at all";
  EXPECT_EQ(store.integer({0x2005, 0}), 9);
  EXPECT_EQ(store.integer({0x2000, 0}), 100) << "what is refused leaves no trace";
  EXPECT_EQ(store.write({0x2002, 0}, le(1, 2)), 0x06010002u) << "read only";
  EXPECT_EQ(store.write({0x2010, 0}, le(1, 2)), 0x06020000u);
  EXPECT_EQ(store.write({0x2000, 1}, le(1, 2)), 0x06090011u);
  EXPECT_EQ(store.write({0x2004, 0}, Bytes(40, 'x')), 0u) << "a string is as long as it is";
}

TEST(ObjectStore, TheNodeItselfSetsWhatOthersMayNot) {
  ObjectStore store = make_store();
  store.set({0x2002, 0}, 0x1234);
  EXPECT_EQ(*store.bytes({0x2002, 0}), (Bytes{0x34, 0x12}));
  EXPECT_TRUE(store.has({0x2002, 0}));
  EXPECT_FALSE(store.has({0x2002, 1}));
  EXPECT_EQ(store.bytes({0x2010, 0}), nullptr);
  store.set({0x2010, 0}, 1);
  EXPECT_FALSE(store.has({0x2010, 0}));
}

TEST(ObjectStore, RestoresTheCommunicationPartOrEverything) {
  ObjectStore store = make_store();
  store.set({0x1005, 0}, 0x81);
  store.set({0x2000, 0}, 7);
  store.restore(true);
  EXPECT_EQ(store.integer({0x1005, 0}), 0x80);
  EXPECT_EQ(store.integer({0x2000, 0}), 7);
  store.restore(false);
  EXPECT_EQ(store.integer({0x2000, 0}), -5);
}

constexpr std::uint32_t kOn = 0x181, kOff = 0x80000181;

struct Record {
  std::uint16_t communication, mapping;
};
class ObjectStoreMapping : public testing::TestWithParam<Record> {};

TEST_P(ObjectStoreMapping, ChangesWhileThePdoIsOffAndEmpty) {
  const auto [communication, mapping] = GetParam();
  ObjectStore store = make_store();
  EXPECT_EQ(store.write({mapping, 1}, le(0x20000010, 4)), 0u);
  EXPECT_EQ(store.write({mapping, 0}, le(1, 1)), 0u) << "writable, though the sheet says ro";
  EXPECT_EQ(store.write({mapping, 2}, le(0x20000010, 4)), 0x06010000u) << "a mapping that is in force";
  EXPECT_EQ(store.write({mapping, 0}, le(0, 1)), 0u);
  EXPECT_EQ(store.write({mapping, 2}, le(0x20000010, 4)), 0u);
  EXPECT_EQ(store.write({communication, 1}, le(kOn, 4)), 0u);
  EXPECT_EQ(store.write({mapping, 0}, le(2, 1)), 0x06010000u) << "a PDO that is on";
  EXPECT_EQ(store.write({mapping, 3}, le(0x20000010, 4)), 0x06010000u) << "a PDO that is on";
  EXPECT_EQ(store.write({communication, 1}, le(kOff, 4)), 0u);
  EXPECT_EQ(store.write({mapping, 0}, le(2, 1)), 0u);
}

TEST_P(ObjectStoreMapping, TakesOnlyWhatCanBeMappedThere) {
  const auto [communication, mapping] = GetParam();
  const bool receive = mapping == 0x1600;
  ObjectStore store = make_store();
  EXPECT_EQ(store.write({mapping, 1}, le(0x20010010, 4)), receive ? 0u : 0x06040041u) << "write only";
  EXPECT_EQ(store.write({mapping, 1}, le(0x20020010, 4)), receive ? 0x06040041u : 0u) << "read only";
  EXPECT_EQ(store.write({mapping, 1}, le(0x20030010, 4)), 0x06040041u) << "not to be mapped";
  EXPECT_EQ(store.write({mapping, 1}, le(0x20000020, 4)), 0x06040041u) << "not as long as the object";
  EXPECT_EQ(store.write({mapping, 1}, le(0x20000110, 4)), 0x06020000u) << "no such sub-index";
  EXPECT_EQ(store.write({mapping, 1}, le(0x20100010, 4)), 0x06020000u) << "no such object";
}

// Four 16-bit values fill eight bytes; over CAN FD there is room for more.
TEST_P(ObjectStoreMapping, HoldsNoMoreThanAFrame) {
  const auto [communication, mapping] = GetParam();
  for (const int bytes : {8, 64}) {
    ObjectStore store = make_store(bytes);
    for (std::uint8_t sub = 1; sub <= 5; ++sub) ASSERT_EQ(store.write({mapping, sub}, le(0x20000010, 4)), 0u);
    EXPECT_EQ(store.write({mapping, 0}, le(5, 1)), bytes == 8 ? 0x06040042u : 0u);
    EXPECT_EQ(store.write({mapping, 0}, le(4, 1)), 0u);
    EXPECT_EQ(store.write({mapping, 0}, le(6, 1)), 0x06090031u) << "there is no sixth";
  }
}

INSTANTIATE_TEST_SUITE_P(Records, ObjectStoreMapping,
                         testing::Values(Record{0x1400, 0x1600}, Record{0x1800, 0x1A00}));

}  // namespace
}  // namespace trn
