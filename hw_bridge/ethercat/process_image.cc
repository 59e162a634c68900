#include "hw_bridge/ethercat/process_image.h"

#include <fmt/format.h>

#include <algorithm>

#include "hw_bridge/ethercat/bytes.h"
#include "hw_bridge/ethercat/frame.h"

namespace poise::ethercat {
namespace {

/// Bits of the objects that the bridge knows, by CiA 402; 0: any.
int StandardBits(uint16_t index) {
  switch (index) {
    case object::kModeOfOperation:
    case object::kModeDisplay:
      return 8;
    case object::kControlword:
    case object::kStatusword:
    case object::kTargetTorque:
    case object::kMaxTorque:
    case object::kTorque:
      return 16;
    case object::kPosition:
    case object::kVelocity:
    case object::kTargetPosition:
    case object::kTargetVelocity:
      return 32;
    default:
      return 0;
  }
}

void Require(const std::vector<uint16_t>& needed, std::string_view pdo, const auto& entries,
             const std::string& profile) {
  for (const uint16_t index : needed) {
    if (std::none_of(entries.begin(), entries.end(),
                     [index](const auto& entry) { return entry.index == index; })) {
      throw EthercatError(fmt::format(
          "drive profile \"{}\": {} lacks object {:04X}, without which no torque is controlled",
          profile, pdo, index));
    }
  }
}

}  // namespace

ProcessImage::Pdo ProcessImage::MakePdo(
    const google::protobuf::RepeatedPtrField<MappedObject>& objects, uint32_t index,
    uint16_t assign, const std::string& profile) {
  const bool rx = assign == object::kRxAssign;
  const uint32_t base = rx ? 0x1600 : 0x1A00;
  if (index < base || index > base + 0x1FF) {
    throw EthercatError(fmt::format("drive profile \"{}\": {}_pdo 0x{:04X} is not in {:04X}-{:04X}",
                                    profile, rx ? "rx" : "tx", index, base, base + 0x1FF));
  }
  Pdo pdo{.index = static_cast<uint16_t>(index), .assign = assign, .entries = {}, .size = 0};
  for (const MappedObject& object : objects) {
    const auto object_index = static_cast<uint16_t>(object.index());
    const int standard = StandardBits(object_index);
    if (object.index() > 0xFFFF || object.subindex() > 0xFF || object.bits() == 0 ||
        object.bits() % 8 != 0 || object.bits() > 32 ||
        (standard != 0 && static_cast<int>(object.bits()) != standard)) {
      throw EthercatError(
          fmt::format("drive profile \"{}\": object {:04X}:{:02X} of {} bits cannot be mapped{}",
                      profile, object.index(), object.subindex(), object.bits(),
                      standard != 0 ? fmt::format("; CiA 402 gives it {}", standard)
                                    : "; give 8, 16, 24 or 32 bits"));
    }
    pdo.entries.push_back({.index = object_index,
                           .subindex = static_cast<uint8_t>(object.subindex()),
                           .bits = static_cast<uint8_t>(object.bits()),
                           .offset = pdo.size});
    pdo.size += object.bits() / 8;
  }
  return pdo;
}

ProcessImage::ProcessImage(const DriveProfile& profile, int num_drives)
    : rx_(MakePdo(profile.rx(), profile.rx_pdo(), object::kRxAssign, profile.name())),
      tx_(MakePdo(profile.tx(), profile.tx_pdo(), object::kTxAssign, profile.name())),
      num_drives_(static_cast<size_t>(num_drives)) {
  Require(
      {object::kControlword, object::kModeOfOperation, object::kTargetTorque, object::kMaxTorque},
      "rx", rx_.entries, profile.name());
  Require({object::kStatusword, object::kModeDisplay, object::kPosition, object::kTorque}, "tx",
          tx_.entries, profile.name());
  // Beside the process data, the cyclic frame has room for the datagrams of AL status and clock.
  constexpr size_t kOthers = 2 * kDatagramOverhead + 2 + 8;
  if (size() > kMaxDatagramData - kOthers) {
    throw EthercatError(
        fmt::format("{} drives with {} bytes each do not fit one frame; at most {} do", num_drives,
                    rx_.size + tx_.size, (kMaxDatagramData - kOthers) / (rx_.size + tx_.size)));
  }
}

void ProcessImage::Put(size_t drive, const DriveOutputs& outputs, std::span<uint8_t> image) const {
  const std::span<uint8_t> bytes = image.subspan(outputs_at(drive), rx_.size);
  for (const Entry& entry : rx_.entries) {
    int64_t value = 0;
    switch (entry.index) {
      case object::kControlword:
        value = outputs.controlword;
        break;
      case object::kModeOfOperation:
        value = outputs.mode;
        break;
      case object::kTargetTorque:
        value = outputs.target_torque;
        break;
      case object::kMaxTorque:
        value = outputs.max_torque;
        break;
      case object::kTargetPosition:
        value = outputs.target_position;
        break;
      case object::kTargetVelocity:
        value = outputs.target_velocity;
        break;
      default:
        break;  // mapped, but nothing the bridge has a value for: zero
    }
    PutSized(bytes, entry.offset, static_cast<uint64_t>(value), entry.bits / 8U);
  }
}

DriveInputs ProcessImage::Get(size_t drive, std::span<const uint8_t> image) const {
  const std::span<const uint8_t> bytes = image.subspan(inputs_at(drive), tx_.size);
  DriveInputs inputs;
  for (const Entry& entry : tx_.entries) {
    const uint64_t value = GetSized(bytes, entry.offset, entry.bits / 8U);
    switch (entry.index) {
      case object::kStatusword:
        inputs.statusword = static_cast<uint16_t>(value);
        break;
      case object::kModeDisplay:
        inputs.mode = static_cast<int8_t>(value);
        break;
      case object::kPosition:
        inputs.position = static_cast<int32_t>(value);
        break;
      case object::kVelocity:
        inputs.velocity = static_cast<int32_t>(value);
        break;
      case object::kTorque:
        inputs.torque = static_cast<int16_t>(value);
        break;
      default:
        break;
    }
  }
  return inputs;
}

void ProcessImage::Configure(SlaveAccess* slave) const {
  ConfigurePdo(rx_, slave);
  ConfigurePdo(tx_, slave);
}

void ProcessImage::ConfigurePdo(const Pdo& pdo, SlaveAccess* slave) {
  if (Mapped(pdo, slave)) return;
  // The order that ETG.1000.6 demands: count 0, entries, count.
  slave->Download({pdo.assign, 0}, 0, 1);
  slave->Download({pdo.index, 0}, 0, 1);
  uint8_t subindex = 0;
  for (const Entry& entry : pdo.entries) {
    const uint32_t mapping =
        uint32_t{entry.index} << 16 | uint32_t{entry.subindex} << 8 | entry.bits;
    slave->Download({pdo.index, ++subindex}, mapping, 4);
  }
  slave->Download({pdo.index, 0}, subindex, 1);
  slave->Download({pdo.assign, 1}, pdo.index, 2);
  slave->Download({pdo.assign, 0}, 1, 1);
  if (!Mapped(pdo, slave)) {
    throw EthercatError(
        fmt::format("{}: accepts the mapping of PDO {:04X} but does not keep it; does the drive "
                    "allow that PDO to be mapped?",
                    slave->Describe(), pdo.index));
  }
}

bool ProcessImage::Mapped(const Pdo& pdo, SlaveAccess* slave) {
  if (slave->Upload({pdo.assign, 0}) != 1 || slave->Upload({pdo.assign, 1}) != pdo.index ||
      slave->Upload({pdo.index, 0}) != pdo.entries.size()) {
    return false;
  }
  for (size_t i = 0; i < pdo.entries.size(); ++i) {
    const Entry& entry = pdo.entries[i];
    const uint32_t mapping = slave->Upload({pdo.index, static_cast<uint8_t>(i + 1)});
    if (mapping >> 16 != entry.index || (mapping >> 8 & 0xFF) != entry.subindex ||
        (mapping & 0xFF) != entry.bits) {
      return false;
    }
  }
  return true;
}

}  // namespace poise::ethercat
