#include "hw_bridge/ethercat/emulator/emulated_slave.h"

#include <algorithm>
#include <bit>
#include <boost/crc.hpp>

#include "hw_bridge/ethercat/process_image.h"

namespace poise::ethercat {
namespace {

// ns from an AL state's request to that state, of real drives' order, SAFE-OP included; and that an
// SDO takes to be answered.
constexpr int64_t kAlTransitionTime = 5'000'000, kMailboxTime = 500'000;
constexpr uint16_t kMailboxOutStart = 0x1000, kMailboxInStart = 0x1080, kMailboxSize = 0x80;
constexpr uint16_t kOutputsStart = 0x1100, kInputsStart = 0x1400;
constexpr uint16_t kRxFixed = 0x1600, kRxUser = 0x1607, kTxFixed = 0x1A00, kTxUser = 0x1A07;

int64_t Nanoseconds(double milliseconds) { return static_cast<int64_t>(milliseconds * 1e6); }

uint32_t Mapping(uint16_t index, uint32_t bits) { return uint32_t{index} << 16 | bits; }

/// Polynomial x^8 + x^2 + x + 1, begun with 0xFF, over the bytes of `words`.
uint8_t SiiChecksum(std::span<const uint16_t> words) {
  boost::crc_optimal<8, 0x07, 0xFF, 0, false, false> crc;
  for (const uint16_t word : words) {
    crc.process_byte(static_cast<uint8_t>(word));
    crc.process_byte(static_cast<uint8_t>(word >> 8));
  }
  return static_cast<uint8_t>(crc.checksum());
}

/// Appends a category; `bytes` are filled up to whole words.
void AddCategory(uint16_t type, std::vector<uint8_t> bytes, std::vector<uint16_t>* words) {
  if (bytes.size() % 2 != 0) bytes.push_back(0);
  words->insert(words->end(), {type, static_cast<uint16_t>(bytes.size() / 2)});
  for (size_t i = 0; i < bytes.size(); i += 2) {
    words->push_back(static_cast<uint16_t>(bytes[i] | bytes[i + 1] << 8));
  }
}

/// ETG.2010. What is not said is zero.
std::vector<uint8_t> SiiGeneral(const EmulatedDriveConfig& config) {
  std::vector<uint8_t> general(32);
  constexpr uint8_t kName = 1;  // the first of the strings
  constexpr uint8_t kSdo = 1, kSdoInformation = 2, kPdoAssignment = 4, kPdoConfiguration = 8,
                    kCompleteAccess = 32;
  const bool free = !config.other() && config.fixed_rx_size() == 0 && config.fixed_tx_size() == 0;
  general[2] = general[3] = kName;  // order, name
  if (config.mailbox()) {
    general[5] = static_cast<uint8_t>(kSdo | kSdoInformation | kPdoAssignment |
                                      (free ? kPdoConfiguration : 0) |
                                      (config.complete_access() ? kCompleteAccess : 0));
  }
  general[9] = config.other() ? 0 : 1;  // channels of CiA 402
  general[16] = 0x11;                   // ports 0 and 1: MII
  return general;
}

std::vector<uint16_t> MakeEeprom(const EmulatedDriveConfig& config) {
  std::vector<uint16_t> words(sii::kCategories, 0);
  const auto put = [&words](size_t word, uint32_t value) {
    words[word] = static_cast<uint16_t>(value);
    words[word + 1] = static_cast<uint16_t>(value >> 16);
  };
  words[sii::kAlias] = static_cast<uint16_t>(config.alias());
  put(sii::kVendor, config.vendor_id());
  put(sii::kProduct, config.product_code());
  put(sii::kRevision, config.revision());
  put(sii::kSerial, config.serial());
  words[sii::kChecksum] = SiiChecksum(std::span(words).first(sii::kChecksum));
  constexpr uint16_t kKibits = 16;
  words[sii::kSize] = kKibits - 1;
  words[sii::kVersion] = 1;
  const std::string name = config.device_name().substr(0, 255);
  std::vector<uint8_t> strings = {1, static_cast<uint8_t>(name.size())};
  strings.insert(strings.end(), name.begin(), name.end());
  AddCategory(sii::kCategoryStrings, strings, &words);
  AddCategory(sii::kCategoryGeneral, SiiGeneral(config), &words);
  constexpr uint8_t kOutputs = 1, kInputs = 2;
  AddCategory(sii::kCategoryFmmu, {kOutputs, kInputs}, &words);
  // Sync manager category: start, length, control and status, activation and type.
  std::vector<uint16_t> managers;
  const auto add = [&managers](uint16_t start, uint16_t size, uint16_t control, uint16_t type) {
    managers.insert(managers.end(), {start, size, control, static_cast<uint16_t>(type << 8 | 1)});
  };
  if (config.mailbox()) {
    put(sii::kMailboxOutOffset, kMailboxOutStart | uint32_t{kMailboxSize} << 16);
    put(sii::kMailboxInOffset, kMailboxInStart | uint32_t{kMailboxSize} << 16);
    words[sii::kMailboxProtocols] = sii::kProtocolCoe;
    add(kMailboxOutStart, kMailboxSize, kSmMailboxOut, 1);
    add(kMailboxInStart, kMailboxSize, kSmMailboxIn, 2);
  }
  add(kOutputsStart, 0, kSmProcessOut, 3);
  add(kInputsStart, 0, kSmProcessIn, 4);
  words.insert(words.end(), {sii::kCategorySyncManagers, static_cast<uint16_t>(managers.size())});
  words.insert(words.end(), managers.begin(), managers.end());
  words.push_back(sii::kCategoryEnd);
  return words;
}

SdoAbort InRange(bool good) { return good ? SdoAbort::kNone : SdoAbort::kValueRange; }

}  // namespace

EmulatedSlave::EmulatedSlave(const EmulatedDriveConfig& config, MotorLoad* load)
    : config_(config),
      esc_(config, MakeEeprom(config)),
      drive_(config, &objects_, load),
      coe_(&objects_, kMailboxSize, config.complete_access()) {
  AddCommonObjects();
  const bool own = config_.other() || config_.fixed_rx_size() > 0 || config_.fixed_tx_size() > 0;
  if (own) {
    AddOwnPdos(object::kRxAssign, config_.fixed_rx(), ObjectDictionary::kRxMappable);
    AddOwnPdos(object::kTxAssign, config_.fixed_tx(), ObjectDictionary::kTxMappable);
    return;
  }
  AddFixedPdo(kRxFixed, {Mapping(object::kControlword, 16), Mapping(object::kTargetPosition, 32)});
  AddFixedPdo(kTxFixed, {Mapping(object::kStatusword, 16), Mapping(object::kPosition, 32)});
  AddFreePdo(object::kRxAssign, kRxUser, ObjectDictionary::kRxMappable);
  AddFreePdo(object::kTxAssign, kTxUser, ObjectDictionary::kTxMappable);
  AddAssignment(object::kRxAssign, {kRxFixed}, {kRxFixed, kRxUser});
  AddAssignment(object::kTxAssign, {kTxFixed}, {kTxFixed, kTxUser});
}

void EmulatedSlave::AddCommonObjects() {
  constexpr uint32_t kServoDrive = 0x00020192;  // device type: CiA 402, servo
  constexpr uint8_t kReadOnly = ObjectDictionary::kReadOnly;
  constexpr uint8_t kRw = ObjectDictionary::kWritable;
  objects_.Add({0x1000, 0}, 4, kReadOnly, config_.other() ? 0 : kServoDrive)->name = "Device type";
  if (objects_.Find({0x1001, 0}) == nullptr) {
    objects_.Add({0x1001, 0}, 1, kReadOnly)->name = "Error register";
  }
  objects_.AddText({0x1008, 0}, config_.device_name())->name = "Manufacturer device name";
  objects_.AddText({0x1009, 0}, "1.0")->name = "Manufacturer hardware version";
  objects_.AddText({0x100A, 0}, "1.0")->name = "Manufacturer software version";
  objects_.Add({0x1018, 0}, 1, kReadOnly, 4)->name = "Identity object";
  objects_.Add({0x1018, 1}, 4, kReadOnly, config_.vendor_id());
  objects_.Add({0x1018, 2}, 4, kReadOnly, config_.product_code());
  objects_.Add({0x1018, 3}, 4, kReadOnly, config_.revision());
  objects_.Add({0x1018, 4}, 4, kReadOnly, config_.serial());
  objects_.Add({0x1C00, 0}, 1, kReadOnly, 4)->name = "Sync manager type";
  for (uint8_t i = 1; i <= 4; ++i) objects_.Add({0x1C00, i}, 1, kReadOnly, i);
  // Sync manager parameters (ETG.1020): synchronised by SYNC0, cycle as SYNC0 has it.
  for (const uint16_t index : {uint16_t{0x1C32}, uint16_t{0x1C33}}) {
    constexpr uint32_t kDcSync0 = 2, kSupported = 0x0006;          // SM event and SYNC0
    constexpr uint32_t kCycle = 2'000'000, kLeastCycle = 125'000;  // ns
    const bool inputs = index == 0x1C33;
    objects_.Add({index, 0}, 1, kReadOnly, 0x20)->name =
        inputs ? "SM input parameter" : "SM output parameter";
    objects_.Add({index, 1}, 2, kRw, kDcSync0, [inputs](uint32_t type) {
      constexpr uint32_t kSmEvent = 1, kSm2Event = 0x22;
      return InRange(type == kSmEvent || type == kDcSync0 || (inputs && type == kSm2Event));
    });
    objects_.Add({index, 2}, 4, kRw, kCycle,
                 [](uint32_t cycle) { return InRange(cycle >= kLeastCycle); });
    objects_.Add({index, 4}, 2, kReadOnly, kSupported);
    objects_.Add({index, 5}, 4, kReadOnly, kLeastCycle);
    objects_.Add({index, 6}, 4, kReadOnly, 0);
    objects_.Add({index, 9}, 4, kReadOnly, 0);
    objects_.Add({index, 0x0B}, 2, kReadOnly, 0);
    objects_.Add({index, 0x20}, 1, kReadOnly, 0);
  }
  // Room for a note of the user's: an object that takes segments.
  constexpr size_t kMostNote = 512;
  objects_.AddText({0x2F00, 0}, "", kMostNote)->name = "User note";
}

void EmulatedSlave::AddAssignment(uint16_t assign, const std::vector<uint16_t>& assigned,
                                  const std::vector<uint16_t>& allowed) {
  constexpr uint8_t kRw = ObjectDictionary::kWritable;
  const auto number = static_cast<uint32_t>(assigned.size());
  Object* const assignment = objects_.Add({assign, 0}, 1, kRw, number, [this](uint32_t count) {
    if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
    return InRange(count <= kMostAssigned);
  });
  assignment->name = assign == object::kRxAssign ? "RxPDO assign" : "TxPDO assign";
  for (uint8_t i = 1; i <= kMostAssigned; ++i) {
    const uint32_t pdo = i <= assigned.size() ? assigned[i - 1U] : 0U;
    objects_.Add({assign, i}, 2, kRw, pdo, [=, this](uint32_t value) {
      if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
      if (Value(assign, 0) != 0) return SdoAbort::kSubindexNotWritable;
      return InRange(std::ranges::find(allowed, value) != allowed.end());
    });
  }
}

void EmulatedSlave::AddFixedPdo(uint16_t pdo, const std::vector<uint32_t>& mappings) {
  const auto number = static_cast<uint32_t>(mappings.size());
  objects_.Add({pdo, 0}, 1, ObjectDictionary::kReadOnly, number)->name = "PDO mapping";
  uint8_t subindex = 0;
  for (const uint32_t mapping : mappings) {
    objects_.Add({pdo, ++subindex}, 4, ObjectDictionary::kReadOnly, mapping);
  }
}

void EmulatedSlave::AddFreePdo(uint16_t assign, uint16_t pdo, uint8_t mappable) {
  constexpr uint8_t kRw = ObjectDictionary::kWritable;
  Object* const mapped = objects_.Add({pdo, 0}, 1, kRw, 0, [=, this](uint32_t count) {
    if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
    for (uint32_t i = 1; i <= Value(assign, 0); ++i) {
      if (Value(assign, i) == pdo) return SdoAbort::kUnsupportedAccess;
    }
    if (count > kMostMapped) return SdoAbort::kPdoTooLong;
    for (uint32_t i = 1; i <= count; ++i) {
      const SdoAbort abort = CheckMapping(Value(pdo, i), mappable);
      if (abort != SdoAbort::kNone) return abort;
    }
    // Entries are given anew: none of an earlier mapping is left to be counted.
    for (uint8_t i = 1; count == 0 && i <= kMostMapped; ++i) objects_.Find({pdo, i})->value = 0;
    return SdoAbort::kNone;
  });
  mapped->name = "PDO mapping";
  for (uint8_t i = 1; i <= kMostMapped; ++i) {
    objects_.Add({pdo, i}, 4, kRw, 0, [=, this](uint32_t mapping) {
      if (state_ != AlState::kPreOp) return SdoAbort::kDeviceState;
      if (Value(pdo, 0) != 0) return SdoAbort::kSubindexNotWritable;
      return CheckMapping(mapping, mappable);
    });
  }
}

void EmulatedSlave::AddOwnPdos(uint16_t assign,
                               const google::protobuf::RepeatedPtrField<MappedObject>& objects,
                               uint8_t mappable) {
  std::vector<uint16_t> pdos;
  std::vector<uint32_t> mappings;
  uint16_t pdo = assign == object::kRxAssign ? kRxFixed : kTxFixed;
  const auto finish = [&] {
    if (mappings.empty()) return;
    pdos.push_back(pdo);
    AddFixedPdo(pdo, mappings);
    mappings.clear();
  };
  for (const MappedObject& mapped : objects) {
    const auto own = mapped.has_pdo() ? static_cast<uint16_t>(mapped.pdo()) : pdo;
    if (own != pdo) finish();
    pdo = own;
    mappings.push_back(mapped.index() << 16 | mapped.subindex() << 8 | mapped.bits());
    const ObjectAddress address{static_cast<uint16_t>(mapped.index()),
                                static_cast<uint8_t>(mapped.subindex())};
    if (address.index == 0 || objects_.Find(address) != nullptr) continue;
    objects_.Add(address, static_cast<uint8_t>(std::min(4U, (mapped.bits() + 7) / 8)), mappable);
  }
  finish();
  AddAssignment(assign, pdos, pdos);
}

SdoAbort EmulatedSlave::CheckMapping(uint32_t mapping, uint8_t mappable) const {
  const Object* object =
      objects_.Find({static_cast<uint16_t>(mapping >> 16), static_cast<uint8_t>(mapping >> 8)});
  const bool fits = object != nullptr && (object->access & mappable) != 0 &&
                    (mapping & 0xFF) == object->size * 8U;
  return fits ? SdoAbort::kNone : SdoAbort::kNotMappable;
}

EmulatedSlave::ProcessData EmulatedSlave::FindMapped(uint16_t assign) {
  ProcessData data;
  const uint32_t pdos = Value(assign, 0);
  for (uint32_t p = 1; p <= pdos; ++p) {
    const auto pdo = static_cast<uint16_t>(Value(assign, p));
    const Object* count = objects_.Find({pdo, 0});
    for (uint32_t i = 1; count != nullptr && i <= count->value; ++i) {
      const uint32_t mapping = Value(pdo, i);
      const size_t bits = mapping & 0xFF;
      data.entries.push_back({objects_.Find({static_cast<uint16_t>(mapping >> 16),
                                             static_cast<uint8_t>(mapping >> 8)}),
                              data.bits, bits});
      data.bits += bits;
    }
  }
  return data;
}

void EmulatedSlave::AdvanceTo(int64_t now) {
  now_ = std::max(now, now_);
  esc_.AdvanceTo(now_);
  if (esc_.al_control_pending()) {
    if (!control_seen_at_) control_seen_at_ = now_;
    if (now_ - *control_seen_at_ >= Nanoseconds(config_.al_response_time())) {
      control_seen_at_.reset();
      HandleAlControl(*esc_.TakeAlControl());
    }
  }
  if (esc_.TakeOutputsWritten()) outputs_seen_ = outputs_pending_ = true;
  const bool sync0 = esc_.TakeSync0();
  sync0_seen_ = sync0_seen_ || sync0;
  FinishTransition();
  if (state_ == AlState::kOp && esc_.watchdog_expired()) {
    Enter(AlState::kSafeOp);
    Fail(AlStatusCode::kSyncManagerWatchdog);
    // The application stops taking outputs: the working counter shows it.
    esc_.SetOutputsDisabled(true);
  }
  if (outputs_pending_ && (sync0 || !esc_.sync0_enabled())) {
    outputs_pending_ = false;
    if (state_ == AlState::kOp) ApplyOutputs();
  }
  if (!config_.other()) drive_.AdvanceTo(now_, state_ == AlState::kOp);
  AnswerMailbox();
  UpdateInputs();
}

void EmulatedSlave::HandleAlControl(uint16_t control) {
  const auto wanted = static_cast<AlState>(control & kAlStateMask);
  if ((control & kAlIdentification) != 0 && config_.has_identification() && !error_) {
    esc_.SetAlStatus(static_cast<uint8_t>(state_) | kAlIdentification,
                     static_cast<AlStatusCode>(config_.identification()));
    return;
  }
  if (error_) {
    if ((control & kAlError) == 0) return;  // an error has to be acknowledged first
    error_ = false;
  }
  requested_.reset();
  esc_.SetAlStatus(static_cast<uint8_t>(state_), AlStatusCode::kNone);
  if (wanted == AlState::kBoot) {
    Fail(AlStatusCode::kBootNotSupported);
  } else if (!std::has_single_bit(static_cast<uint8_t>(wanted))) {
    Fail(AlStatusCode::kUnknownState);
  } else if (static_cast<int>(wanted) > 2 * static_cast<int>(state_)) {  // each twice the one below
    Fail(AlStatusCode::kInvalidStateChange);
  } else if (wanted <= state_) {
    Enter(wanted);
  } else if (const AlStatusCode code = CheckTransition(wanted); code != AlStatusCode::kNone) {
    Fail(code);
  } else {
    requested_ = wanted;
    requested_at_ = now_;
    if (wanted == AlState::kOp) {
      esc_.SetOutputsDisabled(false);
      esc_.RestartWatchdog();
      outputs_seen_ = sync0_seen_ = false;
    }
  }
}

AlStatusCode EmulatedSlave::CheckTransition(AlState state) {
  const auto matches = [this](int index, uint16_t start, size_t length, uint8_t control) {
    constexpr uint8_t kModeAndDirection = kSmModeMask | kSmMasterWrites;
    const EmulatedEsc::SyncManagerSettings sync = esc_.sync_manager(index);
    return sync.active && sync.start == start && sync.length == length &&
           ((sync.control ^ control) & kModeAndDirection) == 0;
  };
  if (state == AlState::kPreOp) {
    const bool mailboxes = matches(kMailboxOut, kMailboxOutStart, kMailboxSize, kSmMailboxOut) &&
                           matches(kMailboxIn, kMailboxInStart, kMailboxSize, kSmMailboxIn);
    if (config_.mailbox() && !mailboxes) return AlStatusCode::kInvalidMailboxConfiguration;
  } else if (state == AlState::kSafeOp) {
    outputs_ = FindMapped(object::kRxAssign);
    inputs_ = FindMapped(object::kTxAssign);
    if (outputs_.bits > 0 &&
        !matches(esc_.output_manager(), kOutputsStart, outputs_.size(), kSmProcessOut)) {
      return AlStatusCode::kInvalidOutputConfiguration;
    }
    if (inputs_.bits > 0 &&
        !matches(esc_.input_manager(), kInputsStart, inputs_.size(), kSmProcessIn)) {
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
  if (state < AlState::kPreOp) {
    // What was under way in the mailbox is gone, an emergency that nobody has read included.
    request_.reset();
    request_counter_ = 0;
    last_reply_.clear();
    coe_.Reset();
    emergencies_.clear();
    esc_.ClearMailboxes();
    static_cast<void>(drive_.TakeEmergency());
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
    if ((outputs_.bits > 0 && !outputs_seen_) || !synced) {
      if (now_ - requested_at_ > Nanoseconds(config_.output_timeout())) {
        Fail(outputs_seen_ ? AlStatusCode::kNoSync : AlStatusCode::kSyncManagerWatchdog);
      }
      return;
    }
  }
  if (now_ - requested_at_ >= kAlTransitionTime) Enter(*requested_);
}

void EmulatedSlave::AnswerMailbox() {
  if (!config_.mailbox() || state_ < AlState::kPreOp) return;
  if (esc_.TakeRepeatRequest()) {
    const std::span<uint8_t> mailbox = esc_.BeginMailboxReply();
    if (mailbox.size() >= last_reply_.size() && !last_reply_.empty()) {
      std::copy(last_reply_.begin(), last_reply_.end(), mailbox.begin());
      esc_.EndMailboxReply();
    }
    esc_.AcknowledgeRepeat();
  }
  if (const std::optional<uint16_t> code = drive_.TakeEmergency()) {
    emergencies_.push_back({.code = *code, .error_register = 1});
  }
  if (!request_) {
    const std::span<const uint8_t> bytes = esc_.TakeMailbox();
    const std::optional<MailboxMessage> message = DecodeMailbox(bytes);
    // Its header tells of more than the mailbox holds.
    if (!bytes.empty() && !message) SendMailboxError(MailboxError::kInvalidSize);
    const bool repeated = message && message->counter != 0 && message->counter == request_counter_;
    if (message && !repeated) {
      request_counter_ = message->counter;
      reply_at_ = now_ + kMailboxTime;
      if (message->type == MailboxType::kCoe) {
        request_.emplace(message->payload.begin(), message->payload.end());
      } else if (message->type != MailboxType::kError) {
        SendMailboxError(MailboxError::kUnsupportedProtocol);
      }
    }
  }
  if (request_ && now_ >= reply_at_) {
    if (const auto error = coe_.Handle(*request_)) SendMailboxError(*error);
    request_.reset();
  }
  if (!emergencies_.empty()) {
    std::vector<uint8_t> message(kSdoMessage);
    EncodeEmergency(emergencies_.front(), 0, message);
    if (esc_.BeginMailboxReply().empty()) return;
    emergencies_.pop_front();
    SendMailbox(message);
  } else if (coe_.has_answer() && !esc_.BeginMailboxReply().empty()) {
    SendMailbox(coe_.TakeAnswer());
  }
}

void EmulatedSlave::SendMailboxError(MailboxError detail) {
  std::vector<uint8_t> error(kMailboxHeader + 4);
  EncodeMailboxError(detail, 0, error);
  SendMailbox(error);
}

void EmulatedSlave::SendMailbox(const std::vector<uint8_t>& message) {
  const std::span<uint8_t> mailbox = esc_.BeginMailboxReply();
  if (mailbox.size() < message.size()) return;  // the master has not yet read the one before
  std::fill(mailbox.begin(), mailbox.end(), uint8_t{0});
  std::copy(message.begin(), message.end(), mailbox.begin());
  reply_counter_ = NextMailboxCounter(reply_counter_);
  mailbox[5] = static_cast<uint8_t>((mailbox[5] & 0x0F) | reply_counter_ << 4);
  last_reply_.assign(mailbox.begin(), mailbox.end());
  esc_.EndMailboxReply();
}

void EmulatedSlave::ApplyOutputs() {
  const std::span<const uint8_t> bytes = esc_.process_outputs();
  if (bytes.size() != outputs_.size()) return;
  for (const Mapped& mapped : outputs_.entries) {
    if (mapped.object == nullptr) continue;
    mapped.object->value = static_cast<uint32_t>(GetBits(bytes, mapped.bit, mapped.bits));
  }
}

void EmulatedSlave::UpdateInputs() {
  if (state_ < AlState::kSafeOp) return;
  const std::span<uint8_t> bytes = esc_.process_inputs();
  if (bytes.size() != inputs_.size()) return;
  std::fill(bytes.begin(), bytes.end(), uint8_t{0});
  for (const Mapped& mapped : inputs_.entries) {
    if (mapped.object == nullptr) continue;
    PutBits(bytes, mapped.bit, mapped.object->value, mapped.bits);
  }
}

}  // namespace poise::ethercat
