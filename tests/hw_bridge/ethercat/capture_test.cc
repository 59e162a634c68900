// Captures of start-up and cyclic operation, read by Wireshark's dissectors (tshark).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <vector>

#include "hw_bridge/ethercat/links/pcap.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {
namespace {

namespace fs = std::filesystem;

/// Standard output of a command; fails the test when the command fails.
std::string Output(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return "";
  std::string text;
  std::array<char, 4096> part;
  for (size_t n; (n = fread(part.data(), 1, part.size(), pipe)) > 0;) text.append(part.data(), n);
  EXPECT_EQ(pclose(pipe), 0) << command;
  return text;
}

/// What tshark makes of one frame.
struct Dissection {
  bool complaint = false;  ///< malformed, cut short, or any expert's remark
  std::string protocol;    ///< "ecat" when the datagrams were recognised
  std::string command, logical_address, working_counter;  ///< of the first of several datagrams
  std::string sdo_response, sdo_index, sdo_data;
};

std::vector<Dissection> Dissect(const std::filesystem::path& path) {
  std::istringstream text(
      Output("tshark -r '" + path.string() +
             "' -T fields -e _ws.malformed -e _ws.short -e _ws.expert.severity -e frame.protocols"
             " -e ecat.sub1.cmd -e ecat.sub1.lad -e ecat.sub1.cnt -e ecat_mailbox.coe.sdores"
             " -e ecat_mailbox.coe.sdoidx -e ecat_mailbox.coe.sdodata 2>/dev/null"));
  std::vector<Dissection> frames;
  for (std::string line; std::getline(text, line);) {
    std::vector<std::string> fields(1);
    for (const char c : line) {
      if (c == '\t') {
        fields.emplace_back();
      } else {
        fields.back() += c;
      }
    }
    fields.resize(10);
    frames.push_back({.complaint = !fields[0].empty() || !fields[1].empty() || !fields[2].empty(),
                      .protocol = fields[3],
                      .command = fields[4],
                      .logical_address = fields[5],
                      .working_counter = fields[6],
                      .sdo_response = fields[7],
                      .sdo_index = fields[8],
                      .sdo_data = fields[9]});
  }
  return frames;
}

class Capture : public ::testing::TestWithParam<CaptureLink::Carrier> {
 protected:
  static void SetUpTestSuite() {
    has_tshark_ = std::system("tshark --version >/dev/null 2>&1") == 0;
  }
  Capture() {
    const bool udp = GetParam() == CaptureLink::Carrier::kUdp;
    directory_ = fs::temp_directory_path() /
                 ("poise_capture_" + std::to_string(getpid()) + (udp ? "_udp" : "_ethernet"));
    fs::create_directories(directory_);
    path_ = directory_ / "frames.pcap";
  }
  ~Capture() override { fs::remove_all(directory_); }

  static bool has_tshark_;
  fs::path directory_, path_;
};
bool Capture::has_tshark_ = false;

TEST_P(Capture, TsharkDecodesStartUpAndCyclesWithoutAComplaint) {
  if (!has_tshark_) GTEST_SKIP() << "tshark is not installed; deploy/setup installs it";
  Bench bench(12);
  bench.master_config.set_drift_frames(20);
  bench.Build();
  CaptureLink capture(std::move(bench.faulty), path_.string(), GetParam());
  bench.master = std::make_unique<Master>(&capture, bench.master_config);
  bench.master->Start();
  bench.SetTorque(321, 1000);
  bench.Drive(DriveGoal::kEnabled, 30);
  ASSERT_EQ(bench.State(11), DriveState::kOperationEnabled);
  ASSERT_TRUE(bench.master->Stop());
  // What a slave refuses is a frame like any other.
  static_cast<void>(ErrorOf([&] { bench.master->slave(0).ChangeState(AlState::kOp); }));
  capture.Close();

  const std::vector<Dissection> frames = Dissect(path_);
  const FrameCounts& counts = bench.master->counts();
  ASSERT_EQ(static_cast<int64_t>(frames.size()), counts.sent + counts.returned);
  // Process data by LRW (0x0c) from logical address 0x10000, going out and coming back.
  int sent = 0, complete = 0, rated_torques = 0;
  for (const Dissection& frame : frames) {
    EXPECT_FALSE(frame.complaint) << &frame - frames.data() + 1;
    EXPECT_THAT(frame.protocol, ::testing::HasSubstr("ecatf:ecat"));
    if (frame.command == "0x0c" && frame.logical_address == "0x00010000") {
      sent += frame.working_counter == "0" ? 1 : 0;
      complete += frame.working_counter == "36" ? 1 : 0;
    }
    // SDO responses of 6076: 1500 mN·m.
    if (!frame.sdo_response.empty() && frame.sdo_index == "0x6076") {
      EXPECT_EQ(frame.sdo_data, "0x000005dc");
      ++rated_torques;
    }
  }
  EXPECT_GT(sent, 30);
  EXPECT_GT(complete, 30);
  EXPECT_EQ(rated_torques, 12);
}

// The check above can fail.
TEST_P(Capture, TsharkComplainsOfAFrameThatIsCutShort) {
  if (!has_tshark_) GTEST_SKIP() << "tshark is not installed; deploy/setup installs it";
  Bench bench(1);
  bench.Build();
  CaptureLink capture(std::move(bench.link), path_.string(), GetParam());
  FrameBuilder builder;
  builder.AddZero(Command::kLrw, 1, 0, 1, 300);
  ASSERT_TRUE(capture.Send(builder.bytes()));
  ASSERT_TRUE(capture.Send(builder.bytes().first(100)));
  capture.Close();
  const std::vector<Dissection> frames = Dissect(path_);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_FALSE(frames[0].complaint);
  EXPECT_TRUE(frames[1].complaint);
}

INSTANTIATE_TEST_SUITE_P(Links, Capture,
                         ::testing::Values(CaptureLink::Carrier::kEthernet,
                                           CaptureLink::Carrier::kUdp),
                         [](const auto& carrier) {
                           return carrier.param == CaptureLink::Carrier::kUdp ? "Udp" : "Ethernet";
                         });

TEST(CaptureLink, NamesAFileThatCannotBe) {
  EXPECT_THAT(ErrorOf([] {
                CaptureLink(nullptr, "/nonexistent/folder/frames.pcap", CaptureLink::Carrier::kUdp);
              }),
              ::testing::HasSubstr("/nonexistent/folder/frames.pcap"));
}

}  // namespace
}  // namespace poise::ethercat
