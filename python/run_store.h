// The messages of one run by channel, encoded, from a log or from a run in this process.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "components/framework/ports.h"
#include "logging/element_names.h"
#include "logging/log_messages.h"
#include "logging/paged_file.h"
#include "logging/run_record.h"
#include "python/message_layout.h"

namespace poise::python {

/// The messages of one channel, one a tick, ticks ascending; of an external channel all, by the
/// time at which they were recorded.
struct StoredChannel {
  StoredChannel(std::string channel, const MessageType& of, std::span<const int32_t> with)
      : name(std::move(channel)), type(&of), counts(with.begin(), with.end()), layout(of, with) {}

  std::string name;
  const MessageType* type;
  std::vector<int32_t> counts;
  MessageLayout layout;
  std::vector<int64_t> ticks;
  std::vector<uint64_t> offsets;  ///< of each message in RunStore's bytes
};

/// Immutable once Finish was called; all threads may read.
class RunStore {
 public:
  /// Indexes a log and maps it; decodes no message. Throws LogError.
  explicit RunStore(const std::string& log);
  /// An empty one in memory, for Add. `spec` must hold the channels' counts.
  RunStore(const RunSpec& spec, std::string scenario);
  RunStore(const RunStore&) = delete;
  RunStore& operator=(const RunStore&) = delete;

  /// Keeps a message of a channel (an index in the graph); ticks ascending. Throws std::bad_alloc.
  void Add(int channel, int64_t tick, const OutputPort& output);
  /// The run's record, where it is known without reading a log.
  void Finish(std::optional<logging::RunRecord> record);

  const std::vector<std::unique_ptr<StoredChannel>>& channels() const { return channels_; }
  /// nullptr: none of that name, or it has no messages of numbers. What DERIVED has is computed
  /// when it is first asked for. Throws LogError likewise.
  const StoredChannel* Find(std::string_view name) const;
  /// The encoded message `row` of a channel. Throws LogError when the log's file is no longer what
  /// it was.
  const uint8_t* Message(const StoredChannel& channel, size_t row) const {
    return (&channel == derived_ ? derived_bytes_->data() : bytes_) + channel.offsets[row];
  }
  /// Throws LogError when the log's file is no longer what it was. Called before Message.
  void CheckUnchanged() const;

  const RunSpec& spec() const { return spec_; }
  const std::string& scenario() const { return scenario_; }
  const std::string& robot_text() const { return robot_; }
  const std::string& maker_text() const { return urdf_; }
  const logging::ElementNames& names() const { return names_; }
  const std::string& log() const { return log_; }  ///< empty: in memory
  /// Places where the log held no record.
  int64_t damages() const { return damages_; }
  /// What metrics are computed from; read from the log on first use. Throws LogError, RobotError.
  logging::RunRecord& record() const;
  std::mutex& record_mutex() const { return record_mutex_; }

 private:
  /// Adds the channel of the derived signals, empty, where the run tells any.
  void AddDerived();
  void ComputeDerived() const;

  std::string log_;
  std::optional<logging::LogMessages> messages_;  // of a log
  RunSpec spec_;
  std::string scenario_, robot_, urdf_;
  logging::ElementNames names_;
  std::vector<std::unique_ptr<StoredChannel>> channels_;
  std::vector<StoredChannel*> of_graph_;  // by index in the graph; nullptr: not kept
  std::vector<uint8_t> memory_;
  const uint8_t* bytes_ = nullptr;
  int64_t damages_ = 0;
  std::optional<robot::RobotModel> model_;  // what signals are derived with
  StoredChannel* derived_ = nullptr;        // in channels_; nullptr: none
  mutable std::once_flag derived_once_;
  mutable std::unique_ptr<logging::PagedFile> derived_bytes_;  // on disk: as large as a log
  mutable std::mutex record_mutex_;
  mutable std::optional<logging::RunRecord> record_;
};

}  // namespace poise::python
