#include "tests/logging/log_test_support.h"

#include <lcm/eventlog.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "components/framework/configuration/configuration.h"
#include "logging/run_log_writer.h"
#include "poise/message_traits.hpp"

namespace poise::logging {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "poise_logging_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

RunSpec MakeTestSpec() {
  RunSpec spec;
  spec.set_run_id(42);
  spec.set_scenario("synthetic");
  spec.set_tick_period(0.002);
  const std::string deploy = std::string(POISE_SOURCE_DIR) + "/deploy/";
  ReadTextProto(deploy + "graphs/balance.pbtxt", spec.mutable_graph());
  for (Channel& channel : *spec.mutable_graph()->mutable_channel()) {
    for (const char* count : FindMessageType(channel.type())->count_names) {
      channel.add_count(std::string(count) == "num_feet" ? 2 : 12);
    }
  }
  for (const auto& [name, file] : {std::pair{"robot", "robots/dyros/dyros_legs.pbtxt"},
                                   std::pair{"urdf", "robots/dyros/dyros_legs.urdf"}}) {
    Resource* resource = spec.add_resource();
    resource->set_name(name);
    resource->set_text(ReadFile(deploy + file));
  }
  return spec;
}

int ChannelIndex(const RunSpec& spec, const std::string& name) {
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    if (spec.graph().channel(i).name() == name) return i;
  }
  throw std::runtime_error("no channel " + name);
}

void WriteRawLog(const std::string& path, const std::vector<RawEvent>& events) {
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "w");
  for (const RawEvent& raw : events) {
    std::string channel = raw.channel;
    std::vector<uint8_t> data = raw.data;
    lcm_eventlog_event_t event{};
    event.timestamp = raw.utime;
    event.channellen = static_cast<int32_t>(channel.size());
    event.datalen = static_cast<int32_t>(data.size());
    event.channel = channel.data();
    event.data = data.data();
    lcm_eventlog_write_event(log, &event);
  }
  lcm_eventlog_destroy(log);
}

RawEvent RunInfoEvent(const RunSpec& spec) {
  return {kRunInfoChannel, 0, Encode(MakeRunInfo(spec, ""))};
}

std::string ReadBytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace poise::logging
