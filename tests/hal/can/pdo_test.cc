#include "hal/can/pdo.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace trn {
namespace {

// 0x2001 to 0x2008 have as many bytes as their last digit says, where a type of that length exists; rw,
// mappable.
ObjectDictionary dictionary() {
  std::string text;
  const auto add = [&](const char* key, int type, const char* access, int mappable) {
    text += fmt::format("[{0}]\nParameterName=P{0}\nDataType={1}\nAccessType={2}\nPDOMapping={3}\n", key,
                        type, access, mappable);
  };
  add("2001", 5, "rw", 1);
  add("2002", 6, "rw", 1);
  add("2004", 7, "rw", 1);
  add("2008", 0x1B, "rw", 1);
  add("3001", 5, "ro", 1);
  add("3002", 5, "wo", 1);
  add("3003", 5, "rw", 0);
  add("3004", 9, "rw", 1);
  return parse_eds(text, "node.eds", 5);
}

std::vector<ObjectKey> several(const std::vector<std::uint16_t>& indices) {
  std::vector<ObjectKey> out;
  for (const std::uint16_t index : indices) out.push_back({index, 0});
  return out;
}

// Greedy and in order: a PDO ends where the next object does not fit. Identifiers: CiA 301, 7.3.3.
TEST(Pdo, IsFilledInOrder) {
  const ObjectDictionary eds = dictionary();
  const auto objects = several({0x2002, 0x2004, 0x2002, 0x2001, 0x2008, 0x2001, 0x2002});
  for (const bool receive : {true, false}) {
    const std::vector<Pdo> pdos = plan_pdos(eds, objects, receive, 5);
    ASSERT_EQ(pdos.size(), 4u);
    const std::vector<std::vector<int>> begins{{0, 2, 6}, {0}, {0}, {0, 1}};
    const int sizes[] = {8, 1, 8, 3};
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(pdos[i].id, (receive ? 0x200u : 0x180u) + 0x100u * i + 5);
      EXPECT_EQ(pdos[i].number, i);
      EXPECT_EQ(pdos[i].size(), sizes[i]);
      EXPECT_EQ(pdos[i].frame_size(), sizes[i]);
      ASSERT_EQ(pdos[i].fields.size(), begins[i].size());
      for (std::size_t k = 0; k < begins[i].size(); ++k) EXPECT_EQ(pdos[i].fields[k].byte, begins[i][k]);
    }
    EXPECT_EQ(pdos[0].fields[1].mapping(), 0x20040020u);
  }
  EXPECT_TRUE(plan_pdos(eds, {}, true, 5).empty());
  EXPECT_EQ(Pdo{}.size(), 0);
}

TEST(Pdo, OverFdHas64BytesInFramesOfLegalLength) {
  const ObjectDictionary eds = dictionary();
  const std::vector<Pdo> eight = plan_pdos(eds, std::vector<ObjectKey>(8, {0x2008, 0}), true, 5, true);
  ASSERT_EQ(eight.size(), 1u);
  EXPECT_EQ(eight[0].size(), 64);
  EXPECT_TRUE(eight[0].fd);
  EXPECT_EQ(plan_pdos(eds, std::vector<ObjectKey>(9, {0x2008, 0}), true, 5, true).size(), 2u);
  // ISO 11898-1: 8, 12, 16, 20, 24, 32, 48, 64
  for (const auto& [objects, frame] :
       {std::pair{2, 8}, std::pair{3, 12}, std::pair{4, 16}, std::pair{5, 20}, std::pair{6, 24},
        std::pair{7, 32}, std::pair{9, 48}, std::pair{13, 64}}) {
    const auto pdos = plan_pdos(eds, std::vector<ObjectKey>(static_cast<std::size_t>(objects), {0x2004, 0}),
                                false, 5, true);
    EXPECT_EQ(pdos.at(0).frame_size(), frame) << objects;
  }
}

TEST(Pdo, FourAreLegal) {
  const ObjectDictionary eds = dictionary();
  EXPECT_EQ(plan_pdos(eds, std::vector<ObjectKey>(4, {0x2008, 0}), true, 5).size(), 4u);
  EXPECT_THROW(plan_pdos(eds, std::vector<ObjectKey>(5, {0x2008, 0}), true, 5), EdsError);
}

TEST(Pdo, TakesOnlyWhatTheSheetAllows) {
  const ObjectDictionary eds = dictionary();
  const auto refused = [&](std::uint16_t index, bool receive) -> std::string {
    try {
      plan_pdos(eds, {{index, 0}}, receive, 5);
      return "";
    } catch (const EdsError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(refused(0x2001, true), "");
  EXPECT_EQ(refused(0x3001, false), "");
  EXPECT_EQ(refused(0x3002, true), "");
  EXPECT_NE(refused(0x3001, true).find("node.eds:21: object 0x3001:0 'P3001' cannot be mapped into a RPDO"),
            std::string::npos)
      << refused(0x3001, true);
  EXPECT_NE(refused(0x3002, false).find("read access"), std::string::npos);
  EXPECT_NE(refused(0x3003, true), "") << "not to be mapped";
  EXPECT_NE(refused(0x3004, true), "") << "of no fixed length";
  EXPECT_NE(refused(0x4000, true).find("0x4000:0 is needed"), std::string::npos) << refused(0x4000, true);
}

TEST(Pdo, AFieldIsFoundWhereItLies) {
  const std::vector<Pdo> pdos = plan_pdos(dictionary(), several({0x2008, 0x2001, 0x2004}), true, 5);
  int pdo = -1;
  PdoField field;
  ASSERT_TRUE(find_field(pdos, {0x2004, 0}, pdo, field));
  EXPECT_EQ(pdo, 1);
  EXPECT_EQ(field.byte, 1);
  EXPECT_EQ(field.bits, 32);
  EXPECT_TRUE(find_field(pdos, {0x2008, 0}, pdo, field));
  EXPECT_EQ(pdo, 0);
  EXPECT_FALSE(find_field(pdos, {0x2004, 1}, pdo, field));
  EXPECT_FALSE(find_field({}, {0x2004, 0}, pdo, field));
}

}  // namespace
}  // namespace trn
