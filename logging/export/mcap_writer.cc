#include "logging/export/mcap_writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <type_traits>

#include "fmt/format.h"
#include "logging/event_log_writer.h"

namespace poise::logging {
namespace {

constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
constexpr size_t kChunkSize = 1 << 20;  // bytes; what other writers take as well
constexpr std::string_view kCompression = "zstd";
constexpr int kLevel = 3;  // zstd's own default; 9 takes 3 times as long for 1.4 % less

enum Opcode : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Content of a record, field by field, little-endian.
class Fields {
 public:
  template <class Integer>
  Fields& Add(Integer value) {
    const auto bits = static_cast<std::make_unsigned_t<Integer>>(value);
    for (size_t i = 0; i < sizeof(Integer); ++i) {
      bytes_.push_back(static_cast<char>(static_cast<uint64_t>(bits) >> (8 * i)));
    }
    return *this;
  }
  Fields& AddString(std::string_view text) {
    Add(static_cast<uint32_t>(text.size()));
    bytes_.append(text);
    return *this;
  }
  Fields& AddBytes(std::string_view bytes) {
    bytes_.append(bytes);
    return *this;
  }
  Fields& AddTexts(const McapWriter::Texts& texts) {
    Fields entries;
    for (const auto& [key, value] : texts) entries.AddString(key).AddString(value);
    return AddString(entries.bytes_);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string Record(Opcode opcode, std::string_view content) {
  return Fields()
      .Add(static_cast<uint8_t>(opcode))
      .Add(static_cast<uint64_t>(content.size()))
      .AddBytes(content)
      .bytes();
}

uint32_t Crc32(uint32_t crc, std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

void McapWriter::Times::Add(uint64_t time, bool is_first) {
  first = is_first ? time : std::min(first, time);
  last = is_first ? time : std::max(last, time);
}

McapWriter::McapWriter(const std::string& path, const std::string& library)
    : path_(path), file_(path) {
  Write(kMcapMagic);
  WriteRecord(kHeader, Fields().AddString("").AddString(library).bytes());
}

void McapWriter::Write(std::string_view bytes) {
  file_.Write(bytes);
  position_ += bytes.size();
  crc_ = Crc32(crc_, bytes);
}

void McapWriter::WriteRecord(uint8_t opcode, std::string_view content) {
  Write(Record(static_cast<Opcode>(opcode), content));
}

void McapWriter::CheckFree(uint16_t used, const char* what) const {
  if (used < UINT16_MAX) return;
  throw LogError(
      fmt::format("{}: MCAP holds at most {} {}, the log has more", path_, UINT16_MAX, what));
}

uint16_t McapWriter::AddSchema(const std::string& name, const std::string& encoding,
                               const std::string& data) {
  CheckFree(num_schemas_, "schemas");
  Fields fields;
  fields.Add(++num_schemas_).AddString(name).AddString(encoding).AddString(data);
  const std::string record = Record(kSchema, fields.bytes());
  chunk_ += record;
  schemas_ += record;
  return num_schemas_;
}

uint16_t McapWriter::AddChannel(uint16_t schema, const std::string& topic,
                                const std::string& encoding, const Texts& metadata) {
  CheckFree(num_channels_, "channels");
  Fields fields;
  fields.Add(++num_channels_).Add(schema).AddString(topic).AddString(encoding).AddTexts(metadata);
  const std::string record = Record(kChannel, fields.bytes());
  chunk_ += record;
  channels_ += record;
  return num_channels_;
}

void McapWriter::AddMessage(uint16_t channel, uint32_t sequence, uint64_t time,
                            std::string_view data) {
  times_.Add(time, num_messages_ == 0);
  chunk_times_.Add(time, chunk_index_.empty());
  chunk_index_[channel].emplace_back(time, chunk_.size());
  ++message_counts_[channel];
  ++num_messages_;
  Fields fields;
  fields.Add(channel).Add(sequence).Add(time).Add(time).AddBytes(data);
  chunk_ += Record(kMessage, fields.bytes());
  if (chunk_.size() >= kChunkSize) EndChunk();
}

void McapWriter::AddMetadata(const std::string& name, const Texts& metadata) {
  const std::string record = Record(kMetadata, Fields().AddString(name).AddTexts(metadata).bytes());
  Fields index;
  index.Add(position_).Add(static_cast<uint64_t>(record.size())).AddString(name);
  metadata_indexes_ += Record(kMetadataIndex, index.bytes());
  ++num_metadata_;
  Write(record);
}

void McapWriter::AddAttachment(const std::string& name, const std::string& media_type,
                               std::string_view data) {
  EndChunk();                    // an attachment stands between chunks
  constexpr uint64_t kTime = 0;  // of no moment of the run
  Fields fields;
  fields.Add(kTime).Add(kTime).AddString(name).AddString(media_type);
  fields.Add(static_cast<uint64_t>(data.size())).AddBytes(data);
  const uint32_t crc = Crc32(0, fields.bytes());
  fields.Add(crc);
  const uint64_t start = position_;
  WriteRecord(kAttachment, fields.bytes());
  Fields index;
  index.Add(start).Add(position_ - start).Add(kTime).Add(kTime);
  index.Add(static_cast<uint64_t>(data.size())).AddString(name).AddString(media_type);
  attachment_indexes_ += Record(kAttachmentIndex, index.bytes());
  ++num_attachments_;
}

std::string_view McapWriter::Compress() {
  compressed_.resize(ZSTD_compressBound(chunk_.size()));
  const size_t size =
      ZSTD_compress(compressed_.data(), compressed_.size(), chunk_.data(), chunk_.size(), kLevel);
  if (ZSTD_isError(size) != 0) {
    throw LogError(fmt::format("{}: zstd failed: {}", path_, ZSTD_getErrorName(size)));
  }
  compressed_.resize(size);
  return compressed_;
}

void McapWriter::EndChunk() {
  if (chunk_.empty()) return;
  const auto size = static_cast<uint64_t>(chunk_.size());
  const uint64_t start = position_;
  Fields chunk;
  chunk.Add(chunk_times_.first).Add(chunk_times_.last).Add(size).Add(Crc32(0, chunk_));
  const std::string_view compressed = Compress();
  const auto compressed_size = static_cast<uint64_t>(compressed.size());
  chunk.AddString(kCompression).Add(compressed_size).AddBytes(compressed);
  WriteRecord(kChunk, chunk.bytes());
  const uint64_t length = position_ - start;

  Fields offsets;
  const uint64_t index_start = position_;
  for (const auto& [channel, messages] : chunk_index_) {
    offsets.Add(channel).Add(position_);
    Fields entries;
    for (const auto& [time, offset] : messages) entries.Add(time).Add(offset);
    WriteRecord(kMessageIndex, Fields().Add(channel).AddString(entries.bytes()).bytes());
  }
  Fields index;
  index.Add(chunk_times_.first).Add(chunk_times_.last).Add(start).Add(length);
  index.AddString(offsets.bytes()).Add(position_ - index_start);
  index.AddString(kCompression).Add(compressed_size).Add(size);
  chunk_indexes_ += Record(kChunkIndex, index.bytes());
  ++num_chunks_;
  chunk_.clear();
  chunk_index_.clear();
  chunk_times_ = {};
}

void McapWriter::Close() {
  EndChunk();
  WriteRecord(kDataEnd, Fields().Add(crc_).bytes());

  crc_ = 0;  // from here on it is the summary's
  const uint64_t summary_start = position_;
  Fields counts;
  for (const auto& [channel, count] : message_counts_) counts.Add(channel).Add(count);
  Fields statistics;
  statistics.Add(num_messages_).Add(num_schemas_).Add(uint32_t{num_channels_});
  statistics.Add(num_attachments_).Add(num_metadata_).Add(num_chunks_);
  statistics.Add(times_.first).Add(times_.last).AddString(counts.bytes());
  std::string offsets;
  const std::pair<Opcode, std::string> groups[] = {
      {kSchema, schemas_},
      {kChannel, channels_},
      {kStatistics, Record(kStatistics, statistics.bytes())},
      {kChunkIndex, chunk_indexes_},
      {kAttachmentIndex, attachment_indexes_},
      {kMetadataIndex, metadata_indexes_}};
  for (const auto& [opcode, records] : groups) {
    if (records.empty()) continue;
    Fields offset;
    offset.Add(static_cast<uint8_t>(opcode)).Add(position_);
    offset.Add(static_cast<uint64_t>(records.size()));
    offsets += Record(kSummaryOffset, offset.bytes());
    Write(records);
  }
  const uint64_t offset_start = position_;
  Write(offsets);
  // The summary's CRC takes in the footer up to itself.
  Fields footer;
  footer.Add(static_cast<uint8_t>(kFooter)).Add(uint64_t{8 + 8 + 4});
  footer.Add(summary_start).Add(offset_start);
  Write(footer.bytes());
  Write(Fields().Add(crc_).bytes());
  Write(kMcapMagic);
  file_.Close();
}

}  // namespace poise::logging
