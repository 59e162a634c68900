#include "tools/foxglove/live_foxglove.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "components/framework/bus/packet_filter.h"
#include "derived/message_traits.hpp"
#include "logging/channel_ticks.h"
#include "logging/element_names.h"

namespace poise {

LiveFoxglove::LiveFoxglove(int port, const std::vector<std::string>& origins,
                           const logging::RunRecord& run, const Scenario& scenario)
    : protobuf_(logging::ElementNames(run.robot)),
      derived_(run.spec, run.robot),
      scene_(run, scenario, [this](size_t topic, uint64_t time, std::string message) {
        server_->Send(topic, time, std::move(message));
      }) {
  std::vector<SceneTopic> topics = scene_.topics();
  for (const Channel& channel : run.spec.graph().channel()) {
    const MessageType& type = logging::ChannelType(channel);
    topics.push_back({channel.name(), "protobuf", logging::ProtobufMessages::FullName(type.name),
                      "protobuf", protobuf_.file_descriptor_set(), false});
  }
  derived_topic_ = topics.size();
  if (derived_.signals().any()) {
    const char* const derived = MessageTraits<derived::signals_t>::kName;
    topics.push_back({logging::kDerivedChannel, "protobuf",
                      logging::ProtobufMessages::FullName(derived), "protobuf",
                      protobuf_.file_descriptor_set(), false});
  }
  server_ = std::make_unique<FoxgloveServer>(port, "poise " + run.spec.scenario(), topics, origins);
  scene_.Begin();
}

void LiveFoxglove::Add(const LiveMessage& message) {
  if (message.index < 0) return;
  scene_.Add(message.channel, *message.type, message.data);
  const size_t topic = scene_.topics().size() + static_cast<size_t>(message.index);
  const int64_t utime = ReadInt64(message.data.data() + message.type->run_id_offset + 16);
  if (utime < 0 || utime >= INT64_MAX / 1'000) return;
  if (message.index == 0) server_->SendTime(static_cast<uint64_t>(utime) * 1'000);
  Send(topic, *message.type, utime, message.data);
  derived_.Add(message.channel, *message.type, message.data);
  AddDerived(false);
}

void LiveFoxglove::Send(size_t topic, const MessageType& type, int64_t utime,
                        std::span<const uint8_t> data) {
  if (!server_->Wants(topic)) return;
  std::optional<std::string> bytes = protobuf_.Convert(type.name, data);
  if (bytes) server_->Send(topic, static_cast<uint64_t>(utime) * 1'000, std::move(*bytes));
}

void LiveFoxglove::AddDerived(bool end) {
  static const MessageType& type = *FindMessageType(MessageTraits<derived::signals_t>::kName);
  int64_t utime = 0;
  std::span<const uint8_t> data;
  while (derived_.Take(end, &utime, &data)) {
    scene_.Add(logging::kDerivedChannel, type, data);
    if (utime >= 0 && utime < INT64_MAX / 1'000) Send(derived_topic_, type, utime, data);
  }
}

void LiveFoxglove::AddStatus(const nlohmann::ordered_json& status) {
  const auto events = status.find("events");
  if (events == status.end()) return;
  for (; num_events_ < events->size(); ++num_events_) {
    const auto& event = (*events)[num_events_];
    scene_.AddEvent(event["time"], event["name"].get<std::string>(),
                    event["detail"].get<std::string>());
  }
}

void LiveFoxglove::Finish() {
  AddDerived(true);
  scene_.End();
}

}  // namespace poise
