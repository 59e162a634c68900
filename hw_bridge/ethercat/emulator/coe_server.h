// CoeServer: answers SDO and SDO information requests from an object dictionary.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "hw_bridge/ethercat/coe.h"
#include "hw_bridge/ethercat/emulator/object_dictionary.h"

namespace poise::ethercat {

/// One transfer at a time, as the standard has it: a new request ends the one before.
class CoeServer {
 public:
  /// `objects` must outlive this. `mailbox`: bytes of an answer, header included, at most.
  CoeServer(ObjectDictionary* objects, size_t mailbox, bool complete_access)
      : objects_(objects), mailbox_(mailbox), complete_access_(complete_access) {}

  /// Takes a CoE payload; answers are queued. A request that is none is answered by an abort, or by
  /// the mailbox error returned.
  std::optional<MailboxError> Handle(std::span<const uint8_t> payload);
  /// A message to be sent to the master, whole but for its counter; empty: none.
  bool has_answer() const { return !answers_.empty(); }
  std::vector<uint8_t> TakeAnswer();
  /// Forgets transfers and answers.
  void Reset();

 private:
  void HandleSdo(const Sdo& sdo);
  void HandleInfo(const SdoInfo& info);
  void BeginUpload(const Sdo& sdo);
  void UploadSegment(const Sdo& sdo);
  void BeginDownload(const Sdo& sdo);
  void DownloadSegment(const Sdo& sdo);
  SdoAbort Store(std::span<const uint8_t> data);
  void Answer(const Sdo& sdo);
  void Abort(ObjectAddress object, SdoAbort code);
  void AnswerInfo(InfoOpcode opcode, std::span<const uint8_t> data);
  void InfoError(SdoAbort code);

  ObjectDictionary* objects_;
  size_t mailbox_;
  bool complete_access_;
  enum class Transfer { kNone, kUpload, kDownload };
  Transfer transfer_ = Transfer::kNone;
  ObjectAddress object_;
  bool complete_ = false, toggle_ = false;
  std::vector<uint8_t> data_;
  size_t done_ = 0, total_ = 0;
  std::deque<std::vector<uint8_t>> answers_;
};

}  // namespace poise::ethercat
