#include "logging/derived/derived_reader.h"

#include "components/robot_files/robot_files.h"
#include "logging/channel_ticks.h"

namespace poise::logging {

DerivedReader::DerivedReader(LogReader* reader, const RunSpec& spec, const robot::RobotModel& robot)
    : reader_(reader) {
  Start(spec, robot);
}

DerivedReader::DerivedReader(LogReader* reader, const LogMessages& messages) : reader_(reader) {
  if (!messages.run_known()) return;
  try {
    own_robot_ = robot::LoadRobotTexts(messages.info().robot, messages.info().urdf);
  } catch (const robot::RobotError&) {
    return;
  }
  Start(messages.spec(), *own_robot_);
}

void DerivedReader::Start(const RunSpec& spec, const robot::RobotModel& robot) {
  for (const Channel& channel : spec.graph().channel()) {
    if (channel.external()) continue;
    lanes_.try_emplace(channel.name(), Lane{&ChannelType(channel), ChannelFilter(spec, channel)});
  }
  derived_.emplace(spec, robot, kMostTicks);
  if (!derived_->signals().any()) derived_.reset();
}

bool DerivedReader::Next(LogEvent* event) {
  LogEvent next;
  while (!derived_ || !derived_->Take(ended_, &next.utime, &next.data)) {
    if (ended_) return false;
    if (!reader_->Next(event)) {
      ended_ = true;
      continue;
    }
    if (!derived_) return true;
    if (event->channel == kDerivedChannel) continue;  // damage alone calls one so
    const auto lane = lanes_.find(event->channel);
    if (lane != lanes_.end() && lane->second.filter.Check(event->data.data(), event->data.size(), 0,
                                                          INT64_MAX) == PacketVerdict::kAccepted) {
      derived_->Add(event->channel, *lane->second.type, event->data);
    }
    return true;
  }
  next.channel = kDerivedChannel;
  *event = next;
  return true;
}

}  // namespace poise::logging
