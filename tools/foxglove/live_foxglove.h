// A run in progress over Foxglove's WebSocket: the channels of its bus, and its scene.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "logging/derived/derived_signals.h"
#include "logging/export/protobuf_messages.h"
#include "logging/run_record.h"
#include "tools/foxglove/foxglove_server.h"
#include "tools/foxglove/scene_topics.h"
#include "tools/run/live_run.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

class LiveFoxglove {
 public:
  /// `run`, of whose info, spec and robot use is made, must outlive it. Throws ConfigError when the
  /// port cannot be had.
  LiveFoxglove(int port, const std::vector<std::string>& origins, const logging::RunRecord& run,
               const Scenario& scenario);

  int port() const { return server_->port(); }
  void Add(const LiveMessage& message);
  /// The status of a page (RunStatus), whose events are told once each.
  void AddStatus(const nlohmann::ordered_json& status);
  /// The run has ended.
  void Finish();
  void Poll() { server_->Poll(); }

 private:
  void Send(size_t topic, const MessageType& type, int64_t utime, std::span<const uint8_t> data);
  /// The derived signals of the ticks that have come; with `end` of all.
  void AddDerived(bool end);

  logging::ProtobufMessages protobuf_;
  logging::DerivedMessages derived_;
  SceneTopics scene_;
  std::unique_ptr<FoxgloveServer> server_;
  size_t derived_topic_ = 0;
  size_t num_events_ = 0;  // told
};

}  // namespace poise
