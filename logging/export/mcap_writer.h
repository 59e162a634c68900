// Writes MCAP files (mcap.dev/spec), chunked and indexed.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "logging/partial_file.h"

namespace poise::logging {

/// One file. Messages go into chunks of about 1 MiB, compressed by zstd, each with its CRC-32, an
/// index by channel and a place in the summary. All functions throw LogError when writing fails.
class McapWriter {
 public:
  using Texts = std::map<std::string, std::string>;

  /// The file is there, in place of one of that name, after Close. Throws LogError also for what
  /// PartialFile refuses.
  McapWriter(const std::string& path, const std::string& library);

  /// Texts must be UTF-8; at most 65,535 schemas and as many channels. Returns the schema's id,
  /// which a channel names. `encoding`: e.g. "protobuf".
  uint16_t AddSchema(const std::string& name, const std::string& encoding, const std::string& data);
  /// Returns the channel's id. `encoding`: of its messages, e.g. "protobuf".
  uint16_t AddChannel(uint16_t schema, const std::string& topic, const std::string& encoding,
                      const Texts& metadata);
  /// `time` in ns.
  void AddMessage(uint16_t channel, uint32_t sequence, uint64_t time, std::string_view data);
  void AddMetadata(const std::string& name, const Texts& metadata);
  /// A file within the file. `media_type` e.g. "application/xml".
  void AddAttachment(const std::string& name, const std::string& media_type, std::string_view data);
  /// Writes the summary. Nothing may be added afterwards.
  void Close();

 private:
  /// (log time, offset in the chunk's records)
  using MessageIndex = std::vector<std::pair<uint64_t, uint64_t>>;
  struct Times {
    uint64_t first = 0;
    uint64_t last = 0;
    void Add(uint64_t time, bool is_first);
  };

  void Write(std::string_view bytes);
  void WriteRecord(uint8_t opcode, std::string_view content);
  void EndChunk();
  /// The chunk as the file holds it. Throws LogError.
  std::string_view Compress();
  void CheckFree(uint16_t used, const char* what) const;

  std::string path_;
  CheckedFile file_;
  uint64_t position_ = 0;  // bytes written
  uint32_t crc_ = 0;       // of them, from the section's start
  std::string chunk_;
  std::string compressed_;  // of the chunk that was written last
  Times chunk_times_;
  std::map<uint16_t, MessageIndex> chunk_index_;
  // Records for the summary, by kind.
  std::string schemas_;
  std::string channels_;
  std::string chunk_indexes_;
  std::string metadata_indexes_;
  std::string attachment_indexes_;
  uint16_t num_schemas_ = 0;
  uint16_t num_channels_ = 0;
  uint32_t num_chunks_ = 0;
  uint32_t num_metadata_ = 0;
  uint32_t num_attachments_ = 0;
  Times times_;
  std::map<uint16_t, uint64_t> message_counts_;
  uint64_t num_messages_ = 0;
};

}  // namespace poise::logging
