#include "app/daemon/machine_tables.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "app/daemon/program_wire.h"
#include "core/units.h"
#include "hal/message_codec.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {
namespace {

TEST(MachineTables, HaveEveryOffsetInMmAndRad) {
  Parameters parameters;  // in inches
  parameters[5221] = 1;
  parameters[5223] = -2;
  parameters[5244] = 90;      // G55, A
  parameters[5381 + 9] = 45;  // G59.3, rotation
  parameters[5211] = 3;       // G92, X
  parameters[5183] = 4;       // G30, Z
  const trunnion::tables_t t = tables_of(parameters, ToolTable(), 25.4);
  ASSERT_EQ(t.offset_count, 12);
  EXPECT_EQ(t.offset_name[0], "G54");
  EXPECT_EQ(t.offset_x[0], 25.4);
  EXPECT_EQ(t.offset_z[0], -50.8);
  EXPECT_EQ(t.offset_name[1], "G55");
  EXPECT_DOUBLE_EQ(t.offset_a[1], kPi / 2);
  EXPECT_EQ(t.offset_name[8], "G59.3");
  EXPECT_DOUBLE_EQ(t.offset_rotation[8], kPi / 4);
  EXPECT_EQ(t.offset_name[9], "G92");
  EXPECT_DOUBLE_EQ(t.offset_x[9], 76.2);
  EXPECT_EQ(t.offset_name[11], "G30");
  EXPECT_DOUBLE_EQ(t.offset_z[11], 101.6);
  EXPECT_EQ(t.tool_count, 0);
}

// As many tools as a packet has room for, with remarks of any length, and the count of the rest.
TEST(MachineTables, OfTheLargestToolTableFitIntoAPacketAndComeBack) {
  std::string text;
  for (int i = 1; i <= 1000; ++i)
    text +=
        fmt::format("T{} P{} X-1.5 Y2.25 Z{}.125 D{} ;{}\n", i, i % 24, i, 0.5 * i, std::string(200, 'x'));
  const trunnion::tables_t t = tables_of(Parameters(), ToolTable::parse(text, "t.tbl"), 1);
  EXPECT_EQ(t.tool_count + t.tools_more, 1000);
  EXPECT_EQ(t.tool_number[41], 42);
  EXPECT_EQ(t.tool_pocket[41], 18);
  EXPECT_EQ(t.tool_z[41], 42.125);
  EXPECT_EQ(t.tool_diameter[41], 21);
  EXPECT_EQ(encode_message(0, "a machine of a long name.tables", t).error, "");
  const ProgramReply back = decode_reply(encode(t));
  EXPECT_EQ(back.kind, ProgramReply::Kind::kTables);
  EXPECT_EQ(back.tables.tool_z, t.tool_z);
  EXPECT_EQ(back.tables.tool_remark, t.tool_remark);
  EXPECT_EQ(back.tables.offset_name, t.offset_name);
}

// The process that sends them may be out of its mind.
TEST(MachineTables, ThatAreCutOrChangedAreRefused) {
  const std::string packet = encode(tables_of(Parameters(), ToolTable(), 1));
  for (std::size_t size = 4; size < packet.size(); ++size)
    EXPECT_THROW(decode_reply(packet.substr(0, size)), std::exception) << size;
  std::string counted = packet;
  counted[8 + 7 + 8 + 8] = 0x7f;  // header, "tables" and its end, hash, time: the count of offsets
  EXPECT_THROW(decode_reply(counted), std::exception);
}

}  // namespace
}  // namespace trn
