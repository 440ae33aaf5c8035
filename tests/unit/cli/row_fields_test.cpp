#include "cli/stream/row_fields.h"

#include <algorithm>
#include <array>
#include <limits>

#include <gtest/gtest.h>

#include "cli/stream/stream_formats.h"

namespace ecaudit::cli {
namespace {

constexpr std::array<std::uint8_t, 3> kBytes{0x00, 0xA5, 0xFF};

void Fill(RowFields& fields) {
  fields.Number("natural", std::numeric_limits<std::uint64_t>::max());
  fields.Number("integer", std::int64_t{-3});
  fields.Real("real", 1.5);
  fields.Bool("yes", true);
  fields.Null("nothing");
  fields.Text("text", "a \"b\"");
  std::string& list = fields.Json("list");
  list += "[1";
  list += ",2]";
  fields.Bytes("bytes", kBytes);
  fields.Json("object") += "{}";
  fields.Close();
}

TEST(RowFields, EveryKindOfValueReadsBack) {
  RowFields fields;
  Fill(fields);
  ASSERT_EQ(fields.all().size(), 9U);
  EXPECT_EQ(fields.Find("natural")->natural, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(fields.Find("integer")->integer, -3);
  EXPECT_EQ(fields.Find("real")->real, 1.5);
  EXPECT_EQ(fields.Find("yes")->natural, 1U);
  EXPECT_EQ(fields.Find("nothing")->kind, RowField::Kind::kNull);
  EXPECT_EQ(fields.TextOf(*fields.Find("text")), "a \"b\"");
  EXPECT_EQ(fields.TextOf(*fields.Find("list")), "[1,2]");
  EXPECT_EQ(fields.TextOf(*fields.Find("object")), "{}");
  const ByteSpan bytes = fields.BytesOf(*fields.Find("bytes"));
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), kBytes.begin(), kBytes.end()));
  EXPECT_EQ(fields.Find("other"), nullptr);
}

TEST(RowFields, NothingIsLeftOfTheRowBefore) {
  RowFields fields;
  Fill(fields);
  fields.Clear();
  EXPECT_TRUE(fields.all().empty());
  EXPECT_EQ(fields.size(), 0U);
  fields.Text("text", "c");
  fields.Close();
  EXPECT_EQ(fields.TextOf(fields.all().front()), "c");
}

TEST(RowFields, JsonLinesAndCsvOfAnEvent) {
  RowFields fields;
  Fill(fields);
  FrameRef frame;
  frame.number = 7;
  const EventRecord record{.type = EventType::kSdo,
                           .frame = frame,
                           .since_start_ns = 2'000'000'001,
                           .time = {},
                           .slave = SlavePos{3},
                           .fields = fields,
                           .text = "upload, done"};
  const StreamFormats& formats = StreamFormats::OfEvents();
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < formats.outputs().size(); ++i) {
    LineOutput output = LineOutput::ToBuffer();
    const auto sink = formats.At(i).events(output, false);
    const EventTable table;
    sink->Begin(table);
    EXPECT_TRUE(output.TakeLines().find('\n') == std::string::npos);
    sink->Row(record);
    lines.push_back(std::string(formats.outputs()[i].name) + ": " + output.TakeLines());
    sink->End();
    EXPECT_EQ(output.TakeLines(), "");
  }
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[1], R"(csv: 2.000000001,7,3,,sdo,"upload, done")");
  EXPECT_EQ(lines[2],
            R"(jsonl: {"event":"sdo","frame":7,"time_s":2.000000001,"slave":3,"station_address":null,)"
            R"("natural":18446744073709551615,"integer":-3,"real":1.5,"yes":true,"nothing":null,"text":"a \"b\"",)"
            R"("list":[1,2],"bytes":"00a5ff","object":{}})");
  EXPECT_NE(lines[0].find("upload, done"), std::string::npos);
}

TEST(StreamFormats, EachCommandHasItsDefaultFirst) {
  EXPECT_EQ(StreamFormats::OfSignals().Help(), "csv (default) or jsonl: one JSON object a line");
  EXPECT_EQ(StreamFormats::OfEvents().Help(), "text (default), csv or jsonl: one JSON object a line");
  EXPECT_EQ(StreamFormats::OfDatagrams().Help(), StreamFormats::OfEvents().Help());
}

}  // namespace
}  // namespace ecaudit::cli
