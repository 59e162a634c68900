#include "hw_bridge/ethercat/emulator/emulated_slave.h"

#include <algorithm>

#include "hw_bridge/ethercat/process_image.h"

namespace poise::ethercat {
namespace {

constexpr uint16_t kMailboxOutStart = 0x1000, kMailboxInStart = 0x1080, kMailboxSize = 0x80;
constexpr uint16_t kOutputsStart = 0x1100, kInputsStart = 0x1400;
constexpr uint16_t kRxFixed = 0x1600, kRxUser = 0x1607, kTxFixed = 0x1A00, kTxUser = 0x1A07;

int64_t Nanoseconds(double milliseconds) { return static_cast<int64_t>(milliseconds * 1e6); }

uint32_t Mapping(uint16_t index, uint32_t bits) { return uint32_t{index} << 16 | bits; }

std::vector<uint16_t> MakeEeprom(const EmulatedDriveConfig& config) {
  std::vector<uint16_t> words(sii::kCategories, 0);
  const auto put = [&words](size_t word, uint32_t value) {
    words[word] = static_cast<uint16_t>(value);
    words[word + 1] = static_cast<uint16_t>(value >> 16);
  };
  put(sii::kVendor, config.vendor_id());
  put(sii::kProduct, config.product_code());
  put(sii::kRevision, config.revision());
  put(sii::kSerial, config.serial());
  put(sii::kMailboxOutOffset, kMailboxOutStart | uint32_t{kMailboxSize} << 16);
  put(sii::kMailboxInOffset, kMailboxInStart | uint32_t{kMailboxSize} << 16);
  words[sii::kMailboxProtocols] = sii::kProtocolCoe;
  // Sync manager category: start, length, control and status, activation and type.
  words.insert(words.end(), {sii::kCategorySyncManagers, 16});
  words.insert(words.end(), {kMailboxOutStart, kMailboxSize, kSmMailboxOut, 0x0101});
  words.insert(words.end(), {kMailboxInStart, kMailboxSize, kSmMailboxIn, 0x0201});
  words.insert(words.end(), {kOutputsStart, 0, kSmProcessOut, 0x0301});
  words.insert(words.end(), {kInputsStart, 0, kSmProcessIn, 0x0401});
  words.push_back(sii::kCategoryEnd);
  return words;
}

int Rank(AlState state) {
  switch (state) {
    case AlState::kInit:
      return 0;
    case AlState::kPreOp:
      return 1;
    case AlState::kSafeOp:
      return 2;
    case AlState::kOp:
      return 3;
    case AlState::kBoot:
      break;
  }
  return -1;
}

}  // namespace

EmulatedSlave::EmulatedSlave(const EmulatedDriveConfig& config, bool last, MotorLoad* load)
    : config_(config),
      esc_({.eeprom = MakeEeprom(config),
            .eeprom_time = static_cast<int64_t>(config.eeprom_time() * 1e3),
            .clock_error = config.clock_error(),
            .clock_start = config.clock_start(),
            .last = last}),
      drive_(config, &objects_, load) {
  constexpr uint32_t kServoDrive = 0x00020192;  // device type: CiA 402, servo
  objects_.Add({0x1000, 0}, 4, ObjectDictionary::kReadOnly, kServoDrive);
  objects_.Add({0x1018, 0}, 1, ObjectDictionary::kReadOnly, 4);
  objects_.Add({0x1018, 1}, 4, ObjectDictionary::kReadOnly, config.vendor_id());
  objects_.Add({0x1018, 2}, 4, ObjectDictionary::kReadOnly, config.product_code());
  objects_.Add({0x1018, 3}, 4, ObjectDictionary::kReadOnly, config.revision());
  objects_.Add({0x1018, 4}, 4, ObjectDictionary::kReadOnly, config.serial());
  objects_.Add({0x1C00, 0}, 1, ObjectDictionary::kReadOnly, 4);
  for (uint8_t i = 1; i <= 4; ++i) {
    objects_.Add({0x1C00, i}, 1, ObjectDictionary::kReadOnly, i);
  }
  AddPdoObjects(object::kRxAssign, kRxFixed, kRxUser, ObjectDictionary::kRxMappable,
                {Mapping(object::kControlword, 16), Mapping(object::kTargetPosition, 32)});
  AddPdoObjects(object::kTxAssign, kTxFixed, kTxUser, ObjectDictionary::kTxMappable,
                {Mapping(object::kStatusword, 16), Mapping(object::kPosition, 32)});
}

void EmulatedSlave::AddPdoObjects(uint16_t assign, uint16_t fixed_pdo, uint16_t user_pdo,
                                  uint8_t mappable, std::initializer_list<uint32_t> fixed) {
  constexpr uint8_t kRw = ObjectDictionary::kWritable;
  objects_.Add({assign, 0}, 1, kRw, 1, [this](uint32_t count) {
    if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
    return count <= 1 ? SdoAbort::kNone : SdoAbort::kValueRange;
  });
  objects_.Add({assign, 1}, 2, kRw, fixed_pdo, [=, this](uint32_t pdo) {
    if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
    if (objects_.Find({assign, 0})->value != 0) return SdoAbort::kSubindexNotWritable;
    return pdo == fixed_pdo || pdo == user_pdo ? SdoAbort::kNone : SdoAbort::kValueRange;
  });
  objects_.Add({fixed_pdo, 0}, 1, ObjectDictionary::kReadOnly, static_cast<uint32_t>(fixed.size()));
  uint8_t subindex = 0;
  for (const uint32_t mapping : fixed) {
    objects_.Add({fixed_pdo, ++subindex}, 4, ObjectDictionary::kReadOnly, mapping);
  }
  objects_.Add({user_pdo, 0}, 1, kRw, 0, [=, this](uint32_t count) {
    if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
    const bool assigned =
        objects_.Find({assign, 0})->value == 1 && objects_.Find({assign, 1})->value == user_pdo;
    if (assigned) return SdoAbort::kUnsupportedAccess;
    if (count > kMostMapped) return SdoAbort::kPdoTooLong;
    for (uint32_t i = 1; i <= count; ++i) {
      const uint32_t mapping = objects_.Find({user_pdo, static_cast<uint8_t>(i)})->value;
      const SdoAbort abort = CheckMapping(mapping, mappable);
      if (abort != SdoAbort::kNone) return abort;
    }
    return SdoAbort::kNone;
  });
  for (uint8_t i = 1; i <= kMostMapped; ++i) {
    objects_.Add({user_pdo, i}, 4, kRw, 0, [=, this](uint32_t mapping) {
      if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
      if (objects_.Find({user_pdo, 0})->value != 0) return SdoAbort::kSubindexNotWritable;
      return CheckMapping(mapping, mappable);
    });
  }
}

SdoAbort EmulatedSlave::CheckMapping(uint32_t mapping, uint8_t mappable) const {
  const Object* object =
      objects_.Find({static_cast<uint16_t>(mapping >> 16), static_cast<uint8_t>(mapping >> 8)});
  const bool fits = object != nullptr && (object->access & mappable) != 0 &&
                    (mapping & 0xFF) == object->size * 8U;
  return fits ? SdoAbort::kNone : SdoAbort::kNotMappable;
}

std::vector<EmulatedSlave::Object*> EmulatedSlave::Mapped(uint16_t assign) {
  std::vector<Object*> mapped;
  if (objects_.Find({assign, 0})->value == 0) return mapped;
  const auto pdo = static_cast<uint16_t>(objects_.Find({assign, 1})->value);
  const uint32_t count = objects_.Find({pdo, 0})->value;
  for (uint32_t i = 1; i <= count; ++i) {
    const uint32_t mapping = objects_.Find({pdo, static_cast<uint8_t>(i)})->value;
    mapped.push_back(
        objects_.Find({static_cast<uint16_t>(mapping >> 16), static_cast<uint8_t>(mapping >> 8)}));
  }
  return mapped;
}

size_t EmulatedSlave::Size(const std::vector<Object*>& mapped) {
  size_t size = 0;
  for (const Object* object : mapped) size += object->size;
  return size;
}

void EmulatedSlave::AdvanceTo(int64_t now) {
  now_ = std::max(now, now_);
  esc_.AdvanceTo(now_);
  if (const std::optional<uint16_t> control = esc_.TakeAlControl()) HandleAlControl(*control);
  if (esc_.TakeOutputsWritten()) outputs_seen_ = outputs_pending_ = true;
  const bool sync0 = esc_.TakeSync0();
  sync0_seen_ = sync0_seen_ || sync0;
  FinishTransition();
  if (state_ == AlState::kOp && esc_.watchdog_expired()) {
    Enter(AlState::kSafeOp);
    Fail(AlStatusCode::kSyncManagerWatchdog);
    // The application stops taking outputs: the working counter shows it.
    esc_.SetSyncManagerDisabled(kProcessOut, true);
  }
  if (outputs_pending_ && (sync0 || !esc_.sync0_enabled())) {
    outputs_pending_ = false;
    if (state_ == AlState::kOp) ApplyOutputs();
  }
  drive_.AdvanceTo(now_, state_ == AlState::kOp);
  AnswerMailbox();
  UpdateInputs();
}

void EmulatedSlave::HandleAlControl(uint16_t control) {
  const auto wanted = static_cast<AlState>(control & kAlStateMask);
  if (error_) {
    if ((control & kAlError) == 0) return;  // an error has to be acknowledged first
    error_ = false;
  }
  requested_.reset();
  esc_.SetAlStatus(static_cast<uint8_t>(state_), AlStatusCode::kNone);
  if (wanted == AlState::kBoot) {
    Fail(AlStatusCode::kBootNotSupported);
  } else if (Rank(wanted) < 0) {
    Fail(AlStatusCode::kUnknownState);
  } else if (Rank(wanted) > Rank(state_) + 1) {
    Fail(AlStatusCode::kInvalidStateChange);
  } else if (Rank(wanted) <= Rank(state_)) {
    Enter(wanted);
  } else if (const AlStatusCode code = CheckTransition(wanted); code != AlStatusCode::kNone) {
    Fail(code);
  } else {
    requested_ = wanted;
    requested_at_ = now_;
    if (wanted == AlState::kOp) {
      esc_.SetSyncManagerDisabled(kProcessOut, false);
      esc_.RestartWatchdog();
      outputs_seen_ = sync0_seen_ = false;
    }
  }
}

AlStatusCode EmulatedSlave::CheckTransition(AlState state) {
  const auto matches = [this](int index, size_t length, uint8_t control, uint8_t mask) {
    const EmulatedEsc::SyncManagerSettings sync = esc_.sync_manager(index);
    return sync.active && sync.length == length && (sync.control & mask) == (control & mask);
  };
  constexpr uint8_t kModeAndDirection = kSmModeMask | kSmMasterWrites;
  if (state == AlState::kPreOp) {
    const bool mailboxes = matches(kMailboxOut, kMailboxSize, kSmMailboxOut, kModeAndDirection) &&
                           matches(kMailboxIn, kMailboxSize, kSmMailboxIn, kModeAndDirection) &&
                           esc_.sync_manager(kMailboxOut).start == kMailboxOutStart &&
                           esc_.sync_manager(kMailboxIn).start == kMailboxInStart;
    if (!mailboxes) return AlStatusCode::kInvalidMailboxConfiguration;
  } else if (state == AlState::kSafeOp) {
    outputs_ = Mapped(object::kRxAssign);
    inputs_ = Mapped(object::kTxAssign);
    if (!matches(kProcessOut, Size(outputs_), kSmProcessOut, kModeAndDirection) ||
        esc_.sync_manager(kProcessOut).start != kOutputsStart) {
      return AlStatusCode::kInvalidOutputConfiguration;
    }
    if (!matches(kProcessIn, Size(inputs_), kSmProcessIn, kModeAndDirection) ||
        esc_.sync_manager(kProcessIn).start != kInputsStart) {
      return AlStatusCode::kInvalidInputConfiguration;
    }
    if (esc_.sync0_enabled() && esc_.sync0_cycle() == 0) return AlStatusCode::kInvalidSync0Cycle;
  }
  return AlStatusCode::kNone;
}

void EmulatedSlave::Enter(AlState state) {
  state_ = state;
  requested_.reset();
  esc_.SetAlStatus(static_cast<uint8_t>(state), AlStatusCode::kNone);
  if (state != AlState::kOp) esc_.RestartWatchdog();
  if (Rank(state) < Rank(AlState::kPreOp)) {
    request_.reset();
    request_counter_ = 0;
    last_reply_.clear();
  }
}

void EmulatedSlave::Fail(AlStatusCode code) {
  error_ = true;
  requested_.reset();
  esc_.SetAlStatus(static_cast<uint8_t>(state_) | kAlError, code);
}

void EmulatedSlave::FinishTransition() {
  if (!requested_) return;
  if (*requested_ == AlState::kOp) {
    // Into OP only with outputs to follow and, if it is to be used, with SYNC0.
    const bool synced = sync0_seen_ || !esc_.sync0_enabled();
    if (!outputs_seen_ || !synced) {
      if (now_ - requested_at_ > Nanoseconds(config_.output_timeout())) {
        Fail(outputs_seen_ ? AlStatusCode::kNoSync : AlStatusCode::kSyncManagerWatchdog);
      }
      return;
    }
  }
  if (now_ - requested_at_ >= Nanoseconds(config_.al_transition_time())) Enter(*requested_);
}

void EmulatedSlave::AnswerMailbox() {
  if (Rank(state_) < Rank(AlState::kPreOp)) return;
  if (esc_.TakeRepeatRequest()) {
    const std::span<uint8_t> mailbox = esc_.BeginMailboxReply();
    if (mailbox.size() >= last_reply_.size() && !last_reply_.empty()) {
      std::copy(last_reply_.begin(), last_reply_.end(), mailbox.begin());
      esc_.EndMailboxReply();
    }
    esc_.AcknowledgeRepeat();
  }
  if (const std::optional<uint16_t> code = drive_.TakeEmergency()) {
    if (const std::span<uint8_t> mailbox = esc_.BeginMailboxReply(); !mailbox.empty()) {
      reply_counter_ = NextMailboxCounter(reply_counter_);
      EncodeEmergency({.code = *code, .error_register = 1}, reply_counter_, mailbox);
      last_reply_.assign(mailbox.begin(), mailbox.end());
      esc_.EndMailboxReply();
    }
  }
  if (!request_) {
    const std::span<const uint8_t> bytes = esc_.TakeMailbox();
    const std::optional<MailboxMessage> message = DecodeMailbox(bytes);
    if (!message) return;
    if (message->counter != 0 && message->counter == request_counter_) return;  // repeated
    request_counter_ = message->counter;
    if (message->type != MailboxType::kCoe) return;
    const std::optional<CoeMessage> coe = DecodeCoe(message->payload);
    if (!coe || coe->service != CoeService::kSdoRequest) return;
    request_ = coe->sdo;
    reply_at_ = now_ + Nanoseconds(config_.mailbox_time() * 1e-3);
  }
  if (now_ >= reply_at_) Reply(*request_);
}

void EmulatedSlave::Reply(const Sdo& sdo) {
  const std::span<uint8_t> mailbox = esc_.BeginMailboxReply();
  if (mailbox.empty()) return;  // the master has not yet read the last answer
  Sdo answer{.object = sdo.object};
  auto abort = SdoAbort::kUnknownCommand;
  if (sdo.command == SdoCommand::kUploadRequest) {
    answer.command = SdoCommand::kUploadResponse;
    abort = objects_.Read(sdo.object, &answer.value, &answer.size);
  } else if (sdo.command == SdoCommand::kDownloadRequest) {
    answer.command = SdoCommand::kDownloadResponse;
    abort = objects_.Write(sdo.object, sdo.value, sdo.size);
  }
  if (abort != SdoAbort::kNone) {
    answer = {.command = SdoCommand::kAbort,
              .object = sdo.object,
              .value = static_cast<uint32_t>(abort),
              .size = 4};
  }
  request_.reset();
  reply_counter_ = NextMailboxCounter(reply_counter_);
  EncodeSdo(answer, CoeService::kSdoResponse, 0, reply_counter_, mailbox);
  last_reply_.assign(mailbox.begin(), mailbox.end());
  esc_.EndMailboxReply();
}

void EmulatedSlave::ApplyOutputs() {
  const std::span<const uint8_t> bytes = esc_.process_outputs();
  if (bytes.size() != Size(outputs_)) return;
  size_t offset = 0;
  for (Object* object : outputs_) {
    object->value = static_cast<uint32_t>(GetSized(bytes, offset, object->size));
    offset += object->size;
  }
}

void EmulatedSlave::UpdateInputs() {
  if (Rank(state_) < Rank(AlState::kSafeOp)) return;
  const std::span<uint8_t> bytes = esc_.process_inputs();
  if (bytes.size() != Size(inputs_)) return;
  size_t offset = 0;
  for (const Object* object : inputs_) {
    PutSized(bytes, offset, object->value, object->size);
    offset += object->size;
  }
}

}  // namespace poise::ethercat
