#include "logging/log_messages.h"

#include "components/framework/bus/packet_filter.h"
#include "logging/channel_ticks.h"

namespace poise::logging {

LogMessages::LogMessages(const std::string& path, Run run) : reader_(path) {
  try {
    run_ = FindRunInfo(&reader_, path);
    run_known_ = true;
    names_ = ElementNames::OfTexts(run_.info.robot, run_.info.urdf);
  } catch (const LogError&) {
    if (run == Run::kNeeded) throw;
    reader_.Rewind();
  }
  for (const Channel& channel : spec().graph().channel()) {
    graph_[channel.name()] = &ChannelType(channel);
  }
}

const MessageType* LogMessages::TypeOf(const LogEvent& event) const {
  const MessageType* const type = WholeMessageType(event);
  const auto known = graph_.find(event.channel);
  return known == graph_.end() || known->second == type ? type : nullptr;
}

std::string LogMessages::Label(std::string_view channel, std::string_view path) const {
  const auto type = graph_.find(channel);
  return type != graph_.end() ? names_.Label(type->second->name, path) : std::string(path);
}

int64_t LogMessages::Tick(const MessageType& type, const LogEvent& event) {
  return ReadInt64(event.data.data() + type.run_id_offset + 8);
}

}  // namespace poise::logging
