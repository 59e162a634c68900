#include "logging/log_sums.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "logging/event_log_writer.h"
#include "tests/logging/log_test_support.h"
#include "tests/logging/small_log.h"

namespace poise::logging {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class LogSumsTest : public ::testing::Test {
 protected:
  void WriteLog(bool sums) {
    EventLogWriter writer(path_);
    for (int i = 0; i < 2500; ++i) {
      const std::vector<uint8_t> data(1000, static_cast<uint8_t>(i));
      writer.Write("CHANNEL", i, data);
    }
    writer.Close(sums);
  }
  void Alter(size_t at) {
    auto bytes = ReadBytes(path_);
    bytes[at] ^= 1;
    WriteBytes(path_, bytes);
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("log");
};

TEST_F(LogSumsTest, ALogIsAsItWasWrittenUntilAByteIsNot) {
  WriteLog(true);
  ASSERT_TRUE(CheckSums(path_));
  EXPECT_THAT(*CheckSums(path_), ElementsAre());
  Alter(1'500'000);
  EXPECT_THAT(*CheckSums(path_),
              ElementsAre("bytes 1048576 to 2097151 are not those that were written"));
  Alter(0);
  Alter(std::filesystem::file_size(path_) - 1);
  EXPECT_EQ(CheckSums(path_)->size(), 3u);
}

TEST_F(LogSumsTest, ALogCutShortOrLongerIsTold) {
  WriteLog(true);
  const auto size = std::filesystem::file_size(path_);
  std::filesystem::resize_file(path_, size - 100);
  EXPECT_THAT(*CheckSums(path_), ElementsAre(HasSubstr("were written")));
  std::filesystem::resize_file(path_, size + 100);  // zeros, in the last block too
  EXPECT_THAT(*CheckSums(path_), ElementsAre(HasSubstr("were written"), HasSubstr("not those")));
}

TEST_F(LogSumsTest, SaysWhenNothingTells) {
  WriteLog(true);
  WriteLog(false);  // in its place
  EXPECT_FALSE(CheckSums(path_));
  WriteBytes(path_ + ".crc32", "nonsense");
  EXPECT_THROW(CheckSums(path_), LogError);
}

}  // namespace
}  // namespace poise::logging
