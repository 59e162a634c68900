// Synthetic runs and logs for the tests of logging.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"

namespace poise::logging {

/// A folder that goes with the test.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  std::string path(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// A run of the balance graph's messages with the default robot's 12 joints, run_id 42, 500 Hz.
RunSpec MakeTestSpec();
/// Index of a channel of MakeTestSpec.
int ChannelIndex(const RunSpec& spec, const std::string& name);

template <class T>
std::vector<uint8_t> Encode(const T& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Header of a message of tick `tick`: run_id 42, utime 2000 us a tick.
template <class T>
void SetHeader(int64_t tick, T* message) {
  message->run_id = 42;
  message->tick = tick;
  message->utime = tick * 2000;
}

/// A log written event by event through liblcm itself, in any order: what a writer under test would
/// not write.
struct RawEvent {
  std::string channel;
  int64_t utime = 0;
  std::vector<uint8_t> data;
};
void WriteRawLog(const std::string& path, const std::vector<RawEvent>& events);
RawEvent RunInfoEvent(const RunSpec& spec);

std::string ReadBytes(const std::string& path);
void WriteBytes(const std::string& path, const std::string& bytes);

}  // namespace poise::logging
