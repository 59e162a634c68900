// A run that stays on the disk answers what one in memory does, and takes no memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <random>
#include <string>

#include "logging/events/events.h"
#include "logging/export/signal_table.h"
#include "logging/metrics/metrics.h"
#include "tests/logging/record_fixture.h"
#include "tests/test_seed.h"

namespace poise::logging {
namespace {

MATCHER(SameNumber, "") {
  const auto& [a, b] = arg;
  return a == b || (std::isnan(a) && std::isnan(b));
}

/// "VmRSS: 1234 kB" of this process, bytes.
int64_t Resident() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "VmRSS:") continue;
    int64_t kilobytes = 0;
    status >> kilobytes;
    return kilobytes * 1024;
  }
  return 0;
}

class PagedRecordTest : public RecordTest {
 protected:
  PagedRecordTest() {
    std::mt19937 random(TestSeed(1));
    std::normal_distribution<double> noise(0, 1);
    for (size_t t = 0; t < kTicks; ++t) {
      for (double& x : truth_[t].com_position) x += 1e-3 * noise(random);
      for (double& x : sensors_[t].foot_wrench[t % 2].force) x += noise(random);
      command_[t].eta = 0.5 + 0.01 * noise(random);
      for (double& x : command_[t].torque) x = noise(random);
      push_[t].force[1] = t > 40 && t < 60 ? 100 + noise(random) : 0;
      plan_[t].in_contact[1] = command_[t].in_contact[1] = t > 70 && t < 80 ? 0 : 1;
    }
  }
};

TEST_F(PagedRecordTest, EveryMetricHasTheSameBits) {
  const RunRecord held = Read();
  const RunRecord paged = ReadRun(path_, 0);
  EXPECT_FALSE(held.paged);
  EXPECT_TRUE(paged.paged);
  ASSERT_EQ(held.num_ticks, paged.num_ticks);
  int answered = 0;
  for (const Metric& metric : Metrics()) {
    const Answer a = metric.compute(held), b = metric.compute(paged);
    ASSERT_EQ(a.has_value(), b.has_value()) << metric.name;
    if (!a) continue;
    ++answered;
    EXPECT_EQ(std::bit_cast<uint64_t>(*a), std::bit_cast<uint64_t>(*b)) << metric.name;
  }
  EXPECT_GT(answered, 40);
  const std::vector<Event> events = Events(held), others = Events(paged);
  ASSERT_EQ(events.size(), others.size());
  EXPECT_GT(events.size(), 3u);
  for (size_t i = 0; i < events.size(); ++i) EXPECT_EQ(events[i].detail, others[i].detail);
}

TEST_F(PagedRecordTest, ATickThatIsNotThereHasNoMessage) {
  Read();
  const RunRecord run = ReadRun(path_, 0);
  for (const int64_t tick : {int64_t{-1}, int64_t{kTicks}, int64_t{1} << 40}) {
    EXPECT_EQ(run.truth.at(tick), nullptr) << tick;
  }
  EXPECT_TRUE(run.drive.empty());  // the log has no such message
  EXPECT_EQ(run.drive.at(3), nullptr);
  const ground_truth_t* const before = run.truth.at(40);
  EXPECT_EQ(run.truth.at(41)->tick, 41);
  EXPECT_EQ(before->tick, 40);  // still there
}

TEST_F(PagedRecordTest, RowsHoldEverySampleBetweenTheirBounds) {
  const RunRecord run = Read();
  const std::vector<ChannelColumns> all = ReadColumns(path_, run);
  for (const int64_t most : {3, 17, 60}) {
    const PageRows rows(0, kTicks, most, 1.0, {});  // at 1 s a tick nothing has surroundings
    const std::vector<ChannelColumns> channels = ReadRows(path_, run, rows);
    ASSERT_EQ(channels.size(), all.size());
    for (size_t c = 0; c < all.size(); ++c) {
      EXPECT_EQ(channels[c].messages, kTicks);
      ASSERT_EQ(channels[c].columns.size(), all[c].columns.size());
      for (size_t k = 0; k < all[c].columns.size(); ++k) {
        const SignalColumn& column = all[c].columns[k];
        const SignalColumn& row = channels[c].columns[k];
        ASSERT_EQ(row.field, column.field);
        // NaN is no number of a row: the first, the least and the largest are of the others.
        std::vector<double> first(static_cast<size_t>(rows.size()), std::nan("")), least = first,
                                                                                   largest = first;
        for (size_t i = column.values.size(); i-- > 0;) {
          int64_t stride = 0;
          const auto r = static_cast<size_t>(rows.RowOf(static_cast<int64_t>(i), &stride));
          least[r] = std::fmin(least[r], column.values[i]);
          largest[r] = std::fmax(largest[r], column.values[i]);
          if (!std::isnan(column.values[i])) first[r] = column.values[i];
        }
        EXPECT_THAT(row.values, testing::Pointwise(SameNumber(), first)) << column.field;
        EXPECT_THAT(row.least, testing::Pointwise(SameNumber(), least)) << column.field;
        EXPECT_THAT(row.largest, testing::Pointwise(SameNumber(), largest)) << column.field;
      }
    }
  }
}

TEST(PagedFile, TakesNoMemoryOfWhatWasWrittenAndRead) {
  constexpr size_t kPiece = 1 << 16, kPieces = 1600;  // 100 MB
  const auto file = PagedFile::Scratch();
  std::vector<uint8_t> piece(kPiece);
  const int64_t before = Resident();
  for (size_t i = 0; i < kPieces; ++i) {
    std::fill(piece.begin(), piece.end(), static_cast<uint8_t>(i));
    EXPECT_EQ(file->Append(piece), i * kPiece);
  }
  EXPECT_LT(Resident() - before, 20 << 20);
  for (size_t i = 0; i < kPieces; ++i) {
    ASSERT_EQ(file->At(i * kPiece)[0], static_cast<uint8_t>(i));
    ASSERT_EQ(file->At(i * kPiece + kPiece - 1)[0], static_cast<uint8_t>(i));
  }
  EXPECT_LT(Resident() - before, 20 << 20);
}

}  // namespace
}  // namespace poise::logging
