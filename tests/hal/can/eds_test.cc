#include "hal/can/eds.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(EncodeInteger, ItsRangeIsThatOfTheType) {
  struct Row {
    DataType type;
    std::int64_t low, high;
  };
  // CiA 301, 7.1.4.3 and 7.1.4.4
  for (const Row& row : {Row{DataType::kInteger8, -128, 127}, Row{DataType::kInteger16, -32768, 32767},
                         Row{DataType::kInteger32, -2147483648LL, 2147483647LL}}) {
    const std::int64_t wrapped_high = 2 * row.high + 1;  // data sheets write -1 as 0xFF.. too
    for (const std::int64_t value : {row.low, row.low + 1, std::int64_t{-1}, std::int64_t{0}, row.high}) {
      const Bytes bytes = encode_integer(row.type, value);
      ASSERT_EQ(static_cast<int>(bytes.size()), bits_of(row.type) / 8) << value;
      EXPECT_EQ(decode_integer(row.type, bytes), value);
    }
    EXPECT_EQ(decode_integer(row.type, encode_integer(row.type, row.high + 1)), row.low);
    EXPECT_EQ(decode_integer(row.type, encode_integer(row.type, wrapped_high)), -1);
    EXPECT_TRUE(encode_integer(row.type, row.low - 1).empty()) << row.low;
    EXPECT_TRUE(encode_integer(row.type, wrapped_high + 1).empty()) << row.low;
  }
  for (const Row& row : {Row{DataType::kUnsigned8, 0, 255}, Row{DataType::kUnsigned16, 0, 65535},
                         Row{DataType::kUnsigned32, 0, 4294967295LL}}) {
    EXPECT_EQ(decode_integer(row.type, encode_integer(row.type, row.high)), row.high);
    EXPECT_EQ(decode_integer(row.type, encode_integer(row.type, 0)), 0);
    EXPECT_TRUE(encode_integer(row.type, -1).empty()) << row.high;
    EXPECT_TRUE(encode_integer(row.type, row.high + 1).empty()) << row.high;
  }
  EXPECT_EQ(encode_integer(DataType::kInteger16, -2), (Bytes{0xFE, 0xFF}));
  EXPECT_EQ(encode_integer(DataType::kUnsigned32, 0x01020304), (Bytes{4, 3, 2, 1}));
  EXPECT_EQ(encode_integer(DataType::kInteger64, -2),
            (Bytes{0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}));
  EXPECT_TRUE(encode_integer(DataType::kVisibleString, 1).empty());
}

std::string name_in(const std::string& bytes) {
  return parse_eds("[6060]\nParameterName=" + bytes + "\nDataType=2\nAccessType=rw\n", "x.eds", 1)
      .name_of({0x6060, 0});
}

// RFC 3629, 4: how many bytes follow which first byte; what is no UTF-8 is of the code page.
TEST(Eds, NamesInUtf8AndInTheCodePage) {
  const std::string u_umlaut = "\xC3\xBC", euro = "\xE2\x82\xAC", clef = "\xF0\x9D\x84\x9E";
  for (const std::string& letter : {u_umlaut, euro, clef})
    EXPECT_EQ(name_in("f" + letter + "r"), "f" + letter + "r");
  EXPECT_EQ(name_in("f\xFCr"), "f" + u_umlaut + "r") << "Windows-1252";
  EXPECT_EQ(name_in("\xC3r"), "\xC3\x83r") << "begins as UTF-8, and is not";
  EXPECT_EQ(name_in("\x80 5"), "EUR 5");
}

std::string error_of(const std::string& text) {
  try {
    parse_eds(text, "x.eds", 1);
  } catch (const EdsError& error) {
    return error.what();
  }
  return "";
}

TEST(Eds, NumbersHave64Bits) {
  const auto sheet = [](const std::string& value) {
    return "[2000]\nDataType=0x15\nDefaultValue=" + value + "\n";
  };
  const auto read = [&](const std::string& value) {
    return parse_eds(sheet(value), "x.eds", 1).integer({0x2000, 0});
  };
  EXPECT_EQ(read("-9223372036854775808"), INT64_MIN);
  EXPECT_EQ(read("0xFFFFFFFFFFFFFFFF"), -1);
  EXPECT_EQ(read("$NODEID+0x7FFFFFFFFFFFFFFE"), INT64_MAX);
  for (const char* value : {"-9223372036854775809", "-0xFFFFFFFFFFFFFFFF", "0x10000000000000000",
                            "$NODEID+0x7FFFFFFFFFFFFFFF", "-9223372036854775808+-1"})
    EXPECT_EQ(error_of(sheet(value)).find("x.eds:3: '" + std::string(value) + "' is no number"), 0u) << value;
}

TEST(Eds, ADataTypeHas16Bits) {
  EXPECT_EQ(parse_eds("[2000]\nDataType=0xFFFF\n", "x.eds", 1).entries.size(), 1u);
  EXPECT_EQ(error_of("[2000]\nDataType=0x10005\n"), "x.eds:2: datatype 65541; legal: 0 to 65535");
  EXPECT_EQ(error_of("[2000]\nDataType=-1\n"), "x.eds:2: datatype -1; legal: 0 to 65535");
}

TEST(Eds, TheNodeIdOfADcfIsOneOfABus) {
  const auto dcf = [](const std::string& id) {
    return "[DeviceComissioning]\nNodeID=" + id + "\n[2000]\nDataType=5\n";
  };
  EXPECT_EQ(parse_eds(dcf("127"), "x.dcf", 1).node_id, 127);
  EXPECT_FALSE(parse_eds(dcf("0"), "x.dcf", 1).node_id.has_value());
  EXPECT_EQ(error_of(dcf("128")), "x.eds:2: nodeid 128; legal: 0 to 127");
  EXPECT_EQ(error_of(dcf("0x100000001")), "x.eds:2: nodeid 4294967297; legal: 0 to 127");
}

TEST(Eds, SubObject0OfACompactArrayIsANumberOfItsOwn) {
  const auto array = [](const std::string& count) {
    return "[2000]\nObjectType=8\nDataType=7\nAccessType=wo\nPDOMapping=1\nHighLimit=9\nParameterValue=3\n"
           "CompactSubObj=" +
           count + "\n";
  };
  const ObjectDictionary dictionary = parse_eds(array("254"), "x.eds", 1);
  EXPECT_EQ(dictionary.entries.size(), 255u);
  EXPECT_FALSE(dictionary.find({0x2000, 254})->readable);
  const DictionaryEntry& zero = *dictionary.find({0x2000, 0});
  EXPECT_EQ(zero.value, Bytes{254});
  EXPECT_TRUE(zero.readable && !zero.writable && !zero.mappable);
  EXPECT_TRUE(zero.configured.empty() && !zero.high);
  EXPECT_EQ(error_of(array("256")), "x.eds:8: compactsubobj 256; legal: 0 to 254");
}

TEST(Eds, CompactListsAreKnownAndOtherSuffixesAreNot) {
  const auto warnings = [](const std::string& suffix) {
    return parse_eds("[1003]\nParameterName=Errors\nDataType=7\n[1003" + suffix + "]\nNrOfEntries=1\n1=x\n",
                     "x.eds", 1)
        .warnings;
  };
  for (const char* suffix : {"Name", "Value", "ObjectLinks", "Denotation"})
    EXPECT_TRUE(warnings(suffix).empty()) << suffix << ": " << warnings(suffix)[0];
  ASSERT_EQ(warnings("Names").size(), 1u);
  EXPECT_EQ(warnings("Names")[0], "x.eds:4: section [1003names] is not known; left out");
}

// Two public files of drives have it: with the limit the master's own heartbeat could not be written.
TEST(Eds, ALimitThatLeavesNoRoomForTheMastersIdIsLeftOut) {
  const ObjectDictionary out = parse_eds(
      "[1016]\nParameterName=Consumer\nObjectType=8\n[1016sub1]\nParameterName=x\nDataType=7\n"
      "AccessType=rw\nLowLimit=0\nHighLimit=65535\n",
      "elmo.eds", 1);
  EXPECT_FALSE(out.find({0x1016, 1})->high);
  ASSERT_EQ(out.warnings.size(), 1u);
  EXPECT_EQ(out.warnings[0],
            "elmo.eds:4: HighLimit 65535 of [1016sub1] leaves no room for a node id; left out");
}

TEST(Eds, ACompactListOfConsumersHasNoSuchLimitEither) {
  const ObjectDictionary out = parse_eds(
      "[1016]\nParameterName=Consumer\nObjectType=8\nDataType=7\nAccessType=rw\nHighLimit=65535\n"
      "CompactSubObj=3\n",
      "elmo.eds", 1);
  for (std::uint8_t sub = 1; sub <= 3; ++sub) EXPECT_FALSE(out.find({0x1016, sub})->high) << int{sub};
  ASSERT_EQ(out.warnings.size(), 1u);
  EXPECT_EQ(out.warnings[0], "elmo.eds:1: HighLimit 65535 of [1016] leaves no room for a node id; left out");
}

TEST(Eds, ASheetIsARegularFileOfText) {
  const auto why = [](const std::function<void()>& read) {
    try {
      read();
    } catch (const EdsError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(why([] { load_eds(testing::TempDir(), 1); }),
            testing::TempDir() + ":1: this is a folder; name a file in it");
  EXPECT_EQ(why([] { load_eds("/dev/zero", 1); }),
            "/dev/zero:1: this is no regular file but a device; name a file on a disk");
  EXPECT_EQ(why([] { parse_eds(std::string_view("\xFF\xFE[\0", 4), "x.eds", 1); }),
            "x.eds:1: this is UTF-16; save the file as UTF-8 or ANSI");
}

}  // namespace
}  // namespace trn
