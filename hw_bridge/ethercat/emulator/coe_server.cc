#include "hw_bridge/ethercat/emulator/coe_server.h"

#include <algorithm>
#include <utility>

#include "hw_bridge/ethercat/links/bytes.h"

namespace poise::ethercat {
namespace {

constexpr size_t kMostObject = 4096;  // bytes of an object that the master may announce
constexpr uint8_t kCodeVariable = 7, kCodeRecord = 9;

}  // namespace

void CoeServer::Reset() {
  transfer_ = Transfer::kNone;
  data_.clear();
  answers_.clear();
}

std::vector<uint8_t> CoeServer::TakeAnswer() {
  std::vector<uint8_t> answer = std::move(answers_.front());
  answers_.pop_front();
  return answer;
}

void CoeServer::Answer(const Sdo& sdo) {
  std::vector<uint8_t> message(EncodedSize(sdo));
  EncodeSdo(sdo, 0, 0, message);
  answers_.push_back(std::move(message));
}

void CoeServer::Abort(ObjectAddress object, SdoAbort code) {
  transfer_ = Transfer::kNone;
  Answer(
      {.command = SdoCommand::kAbort, .object = object, .abort_code = static_cast<uint32_t>(code)});
}

std::optional<MailboxError> CoeServer::Handle(std::span<const uint8_t> payload) {
  if (payload.size() < kCoeHeader) return MailboxError::kSizeTooShort;
  const auto service = static_cast<CoeService>(Get<uint16_t>(payload, 0) >> 12);
  if (service == static_cast<CoeService>(0)) return MailboxError::kInvalidHeader;
  if (service != CoeService::kSdoRequest && service != CoeService::kSdoInformation) {
    return MailboxError::kServiceNotSupported;
  }
  const std::optional<CoeMessage> coe = DecodeCoe(payload);
  if (!coe) return MailboxError::kSizeTooShort;
  if (service == CoeService::kSdoRequest) {
    HandleSdo(coe->sdo);
  } else {
    HandleInfo(coe->info);
  }
  return std::nullopt;
}

void CoeServer::HandleSdo(const Sdo& sdo) {
  switch (sdo.command) {
    case SdoCommand::kUploadRequest:
      return BeginUpload(sdo);
    case SdoCommand::kDownloadRequest:
      return BeginDownload(sdo);
    case SdoCommand::kUploadSegmentRequest:
      return UploadSegment(sdo);
    case SdoCommand::kDownloadSegmentRequest:
      return DownloadSegment(sdo);
    case SdoCommand::kAbort:
      transfer_ = Transfer::kNone;  // the master's: no answer
      return;
    default:
      return Abort(sdo.object, SdoAbort::kUnknownCommand);
  }
}

void CoeServer::BeginUpload(const Sdo& sdo) {
  transfer_ = Transfer::kNone;
  data_.clear();
  SdoAbort abort = SdoAbort::kUnsupportedAccess;
  if (!sdo.complete) {
    abort = objects_->Read(sdo.object, &data_);
  } else if (complete_access_) {
    abort = objects_->ReadComplete(sdo.object, &data_);
  }
  if (abort != SdoAbort::kNone) return Abort(sdo.object, abort);
  const bool expedited = data_.size() <= kExpedited && !data_.empty();
  done_ = expedited ? data_.size() : std::min(data_.size(), mailbox_ - kSdoMessage);
  Answer({.command = SdoCommand::kUploadResponse,
          .object = sdo.object,
          .complete = sdo.complete,
          .expedited = expedited,
          .total = static_cast<uint32_t>(data_.size()),
          .data = std::span(data_).first(done_)});
  if (done_ == data_.size()) return;
  transfer_ = Transfer::kUpload;
  object_ = sdo.object;
  toggle_ = false;
}

void CoeServer::UploadSegment(const Sdo& sdo) {
  if (transfer_ != Transfer::kUpload) return Abort({}, SdoAbort::kUnknownCommand);
  if (sdo.toggle != toggle_) return Abort(object_, SdoAbort::kToggle);
  const size_t part = std::min(data_.size() - done_, mailbox_ - kSegmentHeader);
  const bool last = done_ + part == data_.size();
  Answer({.command = SdoCommand::kUploadSegmentResponse,
          .toggle = toggle_,
          .last = last,
          .data = std::span(data_).subspan(done_, part)});
  done_ += part;
  toggle_ = !toggle_;
  if (last) transfer_ = Transfer::kNone;
}

SdoAbort CoeServer::Store(std::span<const uint8_t> data) {
  return complete_ ? objects_->WriteComplete(object_, data) : objects_->Write(object_, data);
}

void CoeServer::BeginDownload(const Sdo& sdo) {
  transfer_ = Transfer::kNone;
  object_ = sdo.object;
  complete_ = sdo.complete;
  if (complete_ && !complete_access_) return Abort(object_, SdoAbort::kUnsupportedAccess);
  if (sdo.total > kMostObject) return Abort(object_, SdoAbort::kLengthTooHigh);
  if (sdo.data.size() < sdo.total) {
    transfer_ = Transfer::kDownload;
    data_.assign(sdo.data.begin(), sdo.data.end());
    total_ = sdo.total;
    toggle_ = false;
  } else {
    const SdoAbort abort = Store(sdo.data.first(sdo.total));
    if (abort != SdoAbort::kNone) return Abort(object_, abort);
  }
  Answer({.command = SdoCommand::kDownloadResponse, .object = object_, .complete = complete_});
}

void CoeServer::DownloadSegment(const Sdo& sdo) {
  if (transfer_ != Transfer::kDownload) return Abort({}, SdoAbort::kUnknownCommand);
  if (sdo.toggle != toggle_) return Abort(object_, SdoAbort::kToggle);
  data_.insert(data_.end(), sdo.data.begin(), sdo.data.end());
  if (data_.size() > total_) return Abort(object_, SdoAbort::kLengthTooHigh);
  if (sdo.last) {
    if (data_.size() < total_) return Abort(object_, SdoAbort::kLengthTooLow);
    const SdoAbort abort = Store(data_);
    if (abort != SdoAbort::kNone) return Abort(object_, abort);
    transfer_ = Transfer::kNone;
  }
  Answer({.command = SdoCommand::kDownloadSegmentResponse, .toggle = toggle_});
  toggle_ = !toggle_;
}

void CoeServer::AnswerInfo(InfoOpcode opcode, std::span<const uint8_t> data) {
  const size_t room = mailbox_ - kMailboxHeader - kCoeHeader - kInfoHeader;
  const size_t fragments = std::max<size_t>(1, (data.size() + room - 1) / room);
  for (size_t i = 0; i < fragments; ++i) {
    const std::span<const uint8_t> part =
        data.subspan(i * room, std::min(room, data.size() - i * room));
    std::vector<uint8_t> message(kMailboxHeader + kCoeHeader + kInfoHeader + part.size());
    EncodeSdoInfo({.opcode = opcode,
                   .incomplete = i + 1 < fragments,
                   .fragments_left = static_cast<uint16_t>(fragments - 1 - i),
                   .data = part},
                  0, message);
    answers_.push_back(std::move(message));
  }
}

void CoeServer::InfoError(SdoAbort code) {
  std::array<uint8_t, 4> bytes{};
  Put<uint32_t>(bytes, 0, static_cast<uint32_t>(code));
  AnswerInfo(InfoOpcode::kError, bytes);
}

void CoeServer::HandleInfo(const SdoInfo& info) {
  answers_.clear();
  std::vector<uint8_t> data;
  const auto put = [&data](uint64_t value, size_t size) {
    data.resize(data.size() + size);
    PutSized(data, data.size() - size, value, size);
  };
  if (info.opcode == InfoOpcode::kListRequest && info.data.size() >= 2) {
    constexpr uint8_t kMappable[] = {0, ObjectDictionary::kRxMappable,
                                     ObjectDictionary::kTxMappable};
    const auto list = Get<uint16_t>(info.data, 0);
    if (list > 5) return InfoError(SdoAbort::kUnsupportedAccess);
    // List types: 0 the lengths of the five lists, 1 all, 2 Rx and 3 Tx mappable; 4 and 5, what is
    // stored, are empty here.
    std::vector<std::vector<uint16_t>> lists(5);
    for (const auto& [address, object] : objects_->objects()) {
      for (size_t i = 0; i < 3; ++i) {
        if (i > 0 && (object.access & kMappable[i]) == 0) continue;
        if (lists[i].empty() || lists[i].back() != address.index) lists[i].push_back(address.index);
      }
    }
    put(list, 2);
    if (list == 0) {
      for (const auto& each : lists) put(each.size(), 2);
    } else {
      for (const uint16_t index : lists[list - 1U]) put(index, 2);
    }
    return AnswerInfo(InfoOpcode::kListResponse, data);
  }
  const bool entry = info.opcode == InfoOpcode::kEntryRequest;
  if ((!entry && info.opcode != InfoOpcode::kObjectRequest) || info.data.size() < (entry ? 4 : 2)) {
    return InfoError(SdoAbort::kUnknownCommand);
  }
  const auto index = Get<uint16_t>(info.data, 0);
  const int most = objects_->MaxSubindex(index);
  if (most < 0) return InfoError(SdoAbort::kNoObject);
  const std::string name = objects_->NameOf(index);
  put(index, 2);
  if (entry) {
    const ObjectAddress address{index, info.data[2]};
    const ObjectDictionary::Object* object = objects_->Find(address);
    if (object == nullptr) return InfoError(SdoAbort::kNoSubindex);
    put(address.subindex, 1);
    put(0, 1);  // no values beside the description
    put(object->data_type(), 2);
    put(8 * object->bytes(), 2);
    // Readable in PRE-OP, SAFE-OP and OP; writable there; mappable.
    put(0x0007U | ((object->access & ObjectDictionary::kWritable) != 0 ? 0x0038U : 0U) |
            ((object->access & ObjectDictionary::kRxMappable) != 0 ? 0x0040U : 0U) |
            ((object->access & ObjectDictionary::kTxMappable) != 0 ? 0x0080U : 0U),
        2);
  } else {
    const ObjectDictionary::Object* first = objects_->Find({index, 0});
    put(most == 0 && first != nullptr ? first->data_type() : 0, 2);
    put(static_cast<uint64_t>(most), 1);
    put(most == 0 ? kCodeVariable : kCodeRecord, 1);
  }
  data.insert(data.end(), name.begin(), name.end());
  AnswerInfo(entry ? InfoOpcode::kEntryResponse : InfoOpcode::kObjectResponse, data);
}

}  // namespace poise::ethercat
