#include "logging/log_reader.h"

#include <gtest/gtest.h>

#include <random>

#include "fmt/format.h"
#include "tests/logging/log_test_support.h"
#include "tests/test_seed.h"

namespace poise::logging {
namespace {

constexpr size_t kHeader = 28;
constexpr int kEvents = 8;

/// Events of different sizes; channel "C0".."C7".
std::vector<RawEvent> Events() {
  std::vector<RawEvent> events;
  for (int i = 0; i < kEvents; ++i) {
    events.push_back(
        {fmt::format("C{}", i), 100 * i,
         std::vector<uint8_t>(static_cast<size_t>(10 + 3 * i), static_cast<uint8_t>(i + 1))});
  }
  return events;
}

size_t SizeOf(const RawEvent& event) { return kHeader + event.channel.size() + event.data.size(); }

/// Offset of event `index` in the file.
size_t OffsetOf(int index) {
  const std::vector<RawEvent> events = Events();
  size_t offset = 0;
  for (int i = 0; i < index; ++i) offset += SizeOf(events[static_cast<size_t>(i)]);
  return offset;
}

class LogReaderTest : public testing::Test {
 protected:
  LogReaderTest() {
    WriteRawLog(path_, Events());
    bytes_ = ReadBytes(path_);
  }

  /// Channels that are read, whole, from the given bytes.
  std::string Read(const std::string& bytes) {
    WriteBytes(path_, bytes);
    LogReader reader(path_);
    LogEvent event;
    std::string channels;
    const std::vector<RawEvent> events = Events();
    while (reader.Next(&event)) {
      for (const RawEvent& raw : events) {
        if (event.channel == raw.channel && event.utime == raw.utime &&
            std::equal(event.data.begin(), event.data.end(), raw.data.begin(), raw.data.end())) {
          channels += raw.channel[1];
        }
      }
    }
    damages_ = reader.damages();
    skipped_ = reader.skipped_bytes();
    return channels;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("log.lcm");
  std::string bytes_;
  int64_t damages_ = 0;
  int64_t skipped_ = 0;
};

TEST_F(LogReaderTest, ReadsWhatLiblcmWrote) {
  EXPECT_EQ(Read(bytes_), "01234567");
  EXPECT_EQ(damages_, 0);
  EXPECT_EQ(skipped_, 0);
}

TEST_F(LogReaderTest, CutAnywhereLosesOnlyTheCutEvent) {
  for (size_t size = 0; size < bytes_.size(); ++size) {
    int whole = 0;
    while (OffsetOf(whole + 1) <= size) ++whole;
    EXPECT_EQ(Read(bytes_.substr(0, size)),
              std::string("01234567").substr(0, static_cast<size_t>(whole)));
    EXPECT_EQ(damages_, size == OffsetOf(whole) ? 0 : 1) << size;
  }
}

TEST_F(LogReaderTest, DamagedMagicLosesOnlyThatEvent) {
  std::string bytes = bytes_;
  bytes[OffsetOf(3)] = 0;
  EXPECT_EQ(Read(bytes), "0124567");
  EXPECT_EQ(damages_, 1);
  EXPECT_EQ(static_cast<size_t>(skipped_), SizeOf(Events()[3]));
}

TEST_F(LogReaderTest, DamagedLengthsLoseOnlyThatEvent) {
  // Values of every byte of both lengths of event 3.
  for (size_t offset = OffsetOf(3) + 20; offset < OffsetOf(3) + 28; ++offset) {
    for (int value = 0; value < 256; value += 5) {
      std::string bytes = bytes_;
      if (static_cast<unsigned char>(bytes[offset]) == value) continue;
      bytes[offset] = static_cast<char>(value);
      EXPECT_EQ(Read(bytes), "0124567") << offset << " " << value;
    }
  }
}

TEST_F(LogReaderTest, GarbageBetweenEventsIsSkipped) {
  std::string bytes = bytes_.substr(0, OffsetOf(4));
  bytes.append("garbage").append(bytes_, OffsetOf(4));
  EXPECT_EQ(Read(bytes), "01234567");
  EXPECT_EQ(damages_, 1);
  EXPECT_EQ(skipped_, 7);
}

TEST_F(LogReaderTest, RandomDamageNeverCrashes) {
  std::mt19937 random(TestSeed(1));
  const auto below = [&](size_t n) {
    return std::uniform_int_distribution<size_t>(0, n - 1)(random);
  };
  for (int trial = 0; trial < 500; ++trial) {
    std::string bytes = bytes_;
    for (size_t i = below(20) + 1; i > 0; --i)
      bytes[below(bytes.size())] = static_cast<char>(below(256));
    bytes.resize(below(bytes.size()) + 1);
    Read(bytes);  // under the sanitizers this would find a read outside the file
    EXPECT_LE(static_cast<size_t>(skipped_), bytes.size());
  }
}

/// Headers that overlap, each of a record up to the last one: none ends well but that.
std::string OverlappingHeaders(size_t count) {
  const auto append = [](std::string* to, uint64_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) to->push_back(static_cast<char>(value >> (8 * i)));
  };
  std::string bytes;
  for (size_t i = 0; i <= count; ++i) {
    append(&bytes, 0xEDA1DA01u, 4);
    append(&bytes, 7, 8);
    append(&bytes, 0, 8);
    append(&bytes, 1, 4);
    append(&bytes, i < count ? (count - i) * (kHeader + 1) - 2 : 0, 4);
    bytes.push_back('C');
  }
  return bytes;
}

TEST_F(LogReaderTest, HostileLogOfOverlappingHeadersIsReadAtOnce) {
  // Each header against all that follow would be 10^9 looks; the test's time limit would find it.
  const std::string bytes = OverlappingHeaders((2 << 20) / (kHeader + 1));
  Read(bytes);
  EXPECT_EQ(damages_, 1);
  EXPECT_EQ(static_cast<size_t>(skipped_), bytes.size() - (kHeader + 1));
}

TEST_F(LogReaderTest, MissingFileAndFolderAreNamed) {
  for (const std::string& path : {folder_.path("none"), folder_.path("")}) {
    try {
      LogReader reader(path);
      FAIL() << path;
    } catch (const LogError& error) {
      EXPECT_EQ(std::string(error.what()).find(path), 0u) << error.what();
    }
  }
}

TEST_F(LogReaderTest, EmptyFileHasNoEvents) {
  EXPECT_EQ(Read(""), "");
  EXPECT_EQ(damages_, 0);
}

}  // namespace
}  // namespace poise::logging
