#include "logging/export/log_export.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "logging/event_log_writer.h"
#include "logging/export/mcap_writer.h"
#include "poise/external_push_t.hpp"
#include "poise/joint_command_t.hpp"
#include "poise/message_traits.hpp"
#include "tests/logging/small_log.h"

namespace poise::logging {
namespace {

constexpr int64_t kLogExportTicks = 10;
using Row = std::vector<std::string>;

/// Rows of a CSV file, by RFC 4180.
std::vector<Row> ReadCsv(const std::string& path) {
  std::vector<Row> rows = {{""}};
  bool quoted = false;
  const std::string text = ReadBytes(path);
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"' && quoted && i + 1 < text.size() && text[i + 1] == '"') {
      rows.back().back() += text[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      rows.back().emplace_back();
    } else if (c == '\n' && !quoted) {
      rows.push_back({""});
    } else {
      rows.back().back() += c;
    }
  }
  EXPECT_EQ(rows.back(), Row{""});
  rows.pop_back();
  return rows;
}

size_t Column(const Row& header, const std::string& name) {
  const auto found = std::find(header.begin(), header.end(), name);
  EXPECT_NE(found, header.end()) << name;
  return static_cast<size_t>(found - header.begin());
}

class LogExportTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::string log_ = folder_.path("log");
  std::string out_ = folder_.path("csv");
};

TEST_F(LogExportTest, CsvHoldsEveryMessageOfEveryChannel) {
  std::vector<RawEvent> events = SmallLog(kLogExportTicks);
  external_push_t push{};
  SetHeader(kLogExportTicks, &push);
  push.point[2] = 0.1 + 0.2;
  push.force[1] = -4e-320;
  events.push_back({"PUSH", push.utime, Encode(push)});
  WriteRawLog(log_, events);
  const std::vector<ExportedChannel> channels = ExportCsv(log_, out_);
  ASSERT_EQ(channels.size(), 3u);
  for (const ExportedChannel& channel : channels) {
    EXPECT_EQ(channel.refused, 0);
    EXPECT_EQ(ReadCsv(out_ + "/" + channel.channel + ".csv").size(),
              static_cast<size_t>(channel.messages) + 1);
  }
  const std::vector<Row> rows = ReadCsv(out_ + "/PUSH.csv");
  EXPECT_EQ(rows[0], (Row{"time", "tick", "force[0]", "force[1]", "force[2]", "point[0]",
                          "point[1]", "point[2]"}));
  ASSERT_EQ(rows.size(), static_cast<size_t>(kLogExportTicks) + 2);
  EXPECT_EQ(rows[4], (Row{"0.006000", "3", "3.25", "0", "0", "0", "0", "0"}));
  EXPECT_EQ(std::stod(rows.back()[7]), 0.1 + 0.2);  // every digit
  EXPECT_EQ(std::strtod(rows.back()[3].c_str(), nullptr), -4e-320);
  const std::vector<Row> commands = ReadCsv(out_ + "/COMMAND.csv");
  EXPECT_EQ(commands[0].size(), 2u + 6 * 12);
  EXPECT_EQ(commands[6][Column(commands[0], "current[11]")], "5");
  EXPECT_EQ(commands[6][Column(commands[0], "enabled[0]")], "1");
  const std::vector<Row> health = ReadCsv(out_ + "/HEALTH_ROBOT.csv");
  EXPECT_EQ(health[1][Column(health[0], "detail")], "ended, as \"planned\"");
}

TEST_F(LogExportTest, CsvCallsJointsAndFeetByNameAndTellsUnits) {
  joint_command_t command;
  MessageTraits<joint_command_t>::Resize(command, std::array<int32_t, 2>{12, 2});
  SetHeader(0, &command);
  command.torque[3] = 7;
  command.foot_wrench[1].force[2] = -250;
  std::vector<RawEvent> events = {RunInfoEvent(MakeTestSpec()),
                                  {"JOINT_COMMAND", 0, Encode(command)}};
  WriteRawLog(log_, events);
  const auto check = [](const std::string& table, const std::string& units_file,
                        const std::string& channel, const std::string& prefix) {
    const std::vector<Row> rows = ReadCsv(table);
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_EQ(rows[1][Column(rows[0], prefix + "torque[right_knee_pitch]")], "7");
    EXPECT_EQ(rows[1][Column(rows[0], prefix + "foot_wrench[left].force[2]")], "-250");
    nlohmann::json units = nlohmann::json::parse(ReadBytes(units_file));
    if (!channel.empty()) units = units.at(channel);
    ASSERT_EQ(units.size(), rows[0].size());
    for (const std::string& column : rows[0]) EXPECT_TRUE(units.contains(column)) << column;
    EXPECT_EQ(units.at("time"), "s");
    EXPECT_EQ(units.at(prefix + "torque[right_knee_pitch]"), "N·m");
    EXPECT_EQ(units.at(prefix + "foot_wrench[left].force[2]"), "N");
    EXPECT_EQ(units.at(prefix + "eta"), "");
  };
  ExportCsv(log_, out_);
  check(out_ + "/JOINT_COMMAND.csv", out_ + "/columns.json", "JOINT_COMMAND", "");
  ExportMergedCsv(log_, folder_.path("wide.csv"));
  check(folder_.path("wide.csv"), folder_.path("wide.columns.json"), "", "JOINT_COMMAND.");

  events.erase(events.begin());  // whose robot is not known
  WriteRawLog(log_, events);
  ExportMergedCsv(log_, folder_.path("wide.csv"));
  const std::vector<Row> rows = ReadCsv(folder_.path("wide.csv"));
  EXPECT_EQ(rows[1][Column(rows[0], "JOINT_COMMAND.torque[3]")], "7");
}

TEST_F(LogExportTest, MergedHasARowATick) {
  std::vector<RawEvent> events = SmallLog(kLogExportTicks);
  events.erase(events.begin() + 1 + 2 * 4);  // PUSH 4
  events.pop_back();
  std::swap(events[5], events[8]);  // any order: joined by tick
  WriteRawLog(log_, events);
  const std::vector<ExportedChannel> channels = ExportMergedCsv(log_, folder_.path("merged.csv"));
  ASSERT_EQ(channels.size(), 2u);
  EXPECT_EQ(channels[0].messages, kLogExportTicks - 1);
  EXPECT_EQ(channels[1].messages, kLogExportTicks);
  const std::vector<Row> rows = ReadCsv(folder_.path("merged.csv"));
  ASSERT_EQ(rows.size(), static_cast<size_t>(kLogExportTicks) + 1);
  const size_t push = Column(rows[0], "PUSH.force[0]");
  const size_t command = Column(rows[0], "COMMAND.current[3]");
  for (size_t t = 0; t < static_cast<size_t>(kLogExportTicks); ++t) {
    const Row& row = rows[t + 1];
    ASSERT_EQ(row.size(), rows[0].size());
    EXPECT_EQ(row[1], std::to_string(t));
    EXPECT_DOUBLE_EQ(std::stod(row[0]), 0.002 * static_cast<double>(t));
    EXPECT_EQ(row[push], t == 4 ? "" : std::to_string(t) + ".25");
    EXPECT_EQ(row[command], std::to_string(t));
  }
}

TEST_F(LogExportTest, LeavesOutAndCountsWhatIsNoMessageOfItsChannel) {
  std::vector<RawEvent> events = SmallLog(kLogExportTicks);
  events[3].data.resize(30);                     // PUSH 1
  events.push_back({"PUSH", 0, Command(3)});     // of another type
  events.push_back({"../outside", 0, Push(3)});  // a path
  events.push_back({"LCM_SELF_TEST", 0, {'l', 'c', 'm'}});
  WriteRawLog(log_, events);
  int64_t refused = 0;
  for (const ExportedChannel& channel : ExportCsv(log_, out_)) refused += channel.refused;
  EXPECT_EQ(refused, 4);
  EXPECT_FALSE(std::filesystem::exists(folder_.path("outside.csv")));
  EXPECT_EQ(ReadCsv(out_ + "/PUSH.csv").size(), static_cast<size_t>(kLogExportTicks));
  int64_t messages = 0;
  refused = 0;
  for (const ExportedChannel& channel : ExportMcap(log_, folder_.path("log.mcap"))) {
    messages += channel.messages;
    refused += channel.refused;
  }
  EXPECT_EQ(refused, 3);
  EXPECT_EQ(messages + refused, static_cast<int64_t>(events.size()));
}

TEST_F(LogExportTest, McapRefusesNamesThatAreNoUtf8AndMoreThanItHolds) {
  std::vector<RawEvent> events = SmallLog(kLogExportTicks);
  events.push_back({"PU\xffH", 0, Push(3)});
  events.push_back({"PU\x1bH", 0, Push(3)});
  events.push_back({"M\xc3\x84RZ", 0, Push(3)});
  WriteRawLog(log_, events);
  const std::string file = folder_.path("log.mcap");
  for (const ExportedChannel& channel : ExportMcap(log_, file)) {
    const bool bad = channel.channel == "PU\xffH" || channel.channel == "PU\x1bH";
    EXPECT_EQ(channel.refused, bad ? 1 : 0) << channel.channel;
    EXPECT_EQ(channel.messages == 0, bad) << channel.channel;
  }
  const std::string bytes = ReadBytes(file);
  EXPECT_EQ(bytes.find("PU\xffH"), std::string::npos);
  EXPECT_NE(bytes.find("M\xc3\x84RZ"), std::string::npos);

  McapWriter writer(folder_.path("many.mcap"), "test");
  const uint16_t schema = writer.AddSchema("schema", "protobuf", "");
  for (int i = 1; i <= UINT16_MAX; ++i) {
    ASSERT_EQ(writer.AddChannel(schema, std::to_string(i), "protobuf", {}), i);
  }
  EXPECT_THROW(writer.AddChannel(schema, "one more", "protobuf", {}), LogError);
}

TEST_F(LogExportTest, ReplacesNoLogAndLeavesNoPart) {
  WriteRawLog(log_, SmallLog(kLogExportTicks));
  const std::string bytes = ReadBytes(log_);
  EXPECT_THROW(ExportMcap(log_, log_), LogError);
  EXPECT_THROW(ExportMergedCsv(log_, log_), LogError);
  EXPECT_EQ(ReadBytes(log_), bytes);
  ExportMcap(log_, folder_.path("log.mcap"));
  ExportMergedCsv(log_, folder_.path("merged.csv"));
  ExportCsv(log_, out_);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path(""))) {
    EXPECT_NE(entry.path().extension(), ".part") << entry.path();
  }
}

TEST_F(LogExportTest, TablesOfAnotherLogDoNotStandAmongThese) {
  WriteRawLog(log_, SmallLog(kLogExportTicks));
  ExportCsv(log_, out_);
  const std::string push = ReadBytes(out_ + "/PUSH.csv");
  WriteBytes(out_ + "/notes.txt", "mine");
  ExportCsv(log_, out_);  // the same again
  EXPECT_EQ(ReadBytes(out_ + "/PUSH.csv"), push);
  std::vector<RawEvent> fewer = SmallLog(kLogExportTicks + 1);
  std::erase_if(fewer, [](const RawEvent& event) { return event.channel == "COMMAND"; });
  WriteRawLog(log_, fewer);
  try {
    ExportCsv(log_, out_);
    ADD_FAILURE() << "COMMAND.csv of the other log was left among these";
  } catch (const LogError& error) {
    EXPECT_NE(std::string(error.what()).find("COMMAND.csv"), std::string::npos) << error.what();
  }
  EXPECT_EQ(ReadBytes(out_ + "/PUSH.csv"), push);  // nothing was replaced
}

TEST_F(LogExportTest, RefusesWhatCannotBeWritten) {
  WriteRawLog(log_, SmallLog(kLogExportTicks));
  EXPECT_THROW(ExportCsv(log_, log_ + "/x"), LogError);
  EXPECT_THROW(ExportMergedCsv(log_, folder_.path("no/such")), LogError);
  EXPECT_THROW(ExportMcap(log_, folder_.path("no/such")), LogError);
  EXPECT_THROW(ExportMcap(folder_.path("none"), folder_.path("a")), LogError);
}

}  // namespace
}  // namespace poise::logging
