#include "hw_bridge/ethercat/process_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/links/frame.h"

namespace poise::ethercat {
namespace {

/// Bits of the objects that the bridge knows, by CiA 402; 0: any.
uint32_t StandardBits(uint16_t index) {
  constexpr std::pair<uint16_t, uint32_t> kBits[] = {
      {object::kModeOfOperation, 8}, {object::kModeDisplay, 8},    {object::kControlword, 16},
      {object::kStatusword, 16},     {object::kTargetTorque, 16},  {object::kMaxTorque, 16},
      {object::kTorque, 16},         {object::kPosition, 32},      {object::kVelocity, 32},
      {object::kTargetPosition, 32}, {object::kTargetVelocity, 32}};
  const auto* const found = std::ranges::find(kBits, index, &std::pair<uint16_t, uint32_t>::first);
  return found != std::end(kBits) ? found->second : 0;
}

void Require(std::initializer_list<uint16_t> needed, std::string_view pdo, const auto& direction,
             const std::string& profile) {
  for (const uint16_t index : needed) {
    if (direction.Find(index) != nullptr) continue;
    throw EthercatError(
        "drive profile \"{}\": {} lacks object {:04X}, without which no torque is controlled",
        profile, pdo, index);
  }
}

}  // namespace

const ProcessImage::Entry* ProcessImage::Direction::Find(uint16_t index, int subindex) const {
  const auto found = std::find_if(entries.begin(), entries.end(), [&](const Entry& entry) {
    return entry.index == index && (subindex < 0 || entry.subindex == subindex);
  });
  return found != entries.end() ? &*found : nullptr;
}

ProcessImage::Direction ProcessImage::MakeDirection(const DriveProfile& profile, bool rx) {
  const uint32_t base = rx ? 0x1600 : 0x1A00;
  Direction direction;
  uint32_t pdo = rx ? profile.rx_pdo() : profile.tx_pdo();
  for (const MappedObject& object : rx ? profile.rx() : profile.tx()) {
    if (object.has_pdo()) pdo = object.pdo();
    if (pdo < base || pdo > base + 0x1FF) {
      throw EthercatError("drive profile \"{}\": {}_pdo 0x{:04X} is not in {:04X}-{:04X}",
                          profile.name(), rx ? "rx" : "tx", pdo, base, base + 0x1FF);
    }
    const auto index = static_cast<uint16_t>(object.index());
    const uint32_t standard = StandardBits(index);
    const bool aligned = standard == 0 || direction.bits % 8 == 0;
    if (!aligned || (standard != 0 && object.bits() != standard)) {
      throw EthercatError(
          "drive profile \"{}\": object {:04X}:{:02X} of {} bits cannot be mapped{}",
          profile.name(), object.index(), object.subindex(), object.bits(),
          aligned ? fmt::format("; CiA 402 gives it {}", standard) : "; it must begin with a byte");
    }
    const auto own = static_cast<uint16_t>(pdo);
    if (direction.pdos.empty() || direction.pdos.back() != own) direction.pdos.push_back(own);
    direction.entries.push_back({.index = index,
                                 .subindex = static_cast<uint8_t>(object.subindex()),
                                 .bits = static_cast<uint8_t>(object.bits()),
                                 .bit = direction.bits,
                                 .pdo = own});
    direction.bits += object.bits();
  }
  if (direction.bits % 8 != 0) {
    throw EthercatError(
        "drive profile \"{}\": {} has {} bits, which are no whole bytes; add a gap (index 0)",
        profile.name(), rx ? "rx" : "tx", direction.bits);
  }
  return direction;
}

ProcessImage::ProcessImage(const MasterConfig& config) {
  const auto add = [this](const DriveProfile& profile) {
    slaves_.push_back({.rx = MakeDirection(profile, true),
                       .tx = MakeDirection(profile, false),
                       .fixed = profile.fixed_mapping()});
  };
  for (const DriveConfig& drive : config.drive()) {
    const DriveProfile& profile = drive.has_profile() ? drive.profile() : config.profile();
    add(profile);
    Require({object::kControlword, object::kTargetTorque}, "rx", slaves_.back().rx, profile.name());
    Require({object::kStatusword, object::kPosition, object::kTorque}, "tx", slaves_.back().tx,
            profile.name());
  }
  for (const OtherSlave& other : config.other()) add(other.profile());
  for (Slave& slave : slaves_) {
    slave.outputs_at = outputs_size_;
    outputs_size_ += slave.rx.size();
    writes_ += slave.rx.size() > 0 ? 1 : 0;
    reads_ += slave.tx.size() > 0 ? 1 : 0;
  }
  size_ = outputs_size_;
  for (Slave& slave : slaves_) {
    slave.inputs_at = size_;
    size_ += slave.tx.size();
  }
  // Beside the process data, the cyclic frame has room for the datagrams of AL status and clock.
  constexpr size_t kOthers = 2 * kDatagramOverhead + 2 + 8;
  constexpr size_t kRoom = kMaxDatagramData - kOthers;
  if (size() > kRoom) {
    throw EthercatError("{} slaves with {} bytes each do not fit one frame; at most {} do",
                        num_slaves(), size() / num_slaves(), kRoom / (size() / num_slaves()));
  }
}

void ProcessImage::Put(size_t slave, const DriveOutputs& outputs, std::span<uint8_t> image) const {
  const std::span<uint8_t> bytes = image.subspan(outputs_at(slave), outputs_of(slave));
  // What else is mapped stays zero.
  const auto put = [&](uint16_t index, int64_t value) {
    for (const Entry& entry : slaves_[slave].rx.entries) {
      if (entry.index != index) continue;
      PutSized(bytes, entry.bit / 8, static_cast<uint64_t>(value), entry.bits / 8U);
    }
  };
  put(object::kControlword, outputs.controlword);
  put(object::kModeOfOperation, outputs.mode);
  put(object::kTargetTorque, outputs.target_torque);
  put(object::kMaxTorque, outputs.max_torque);
}

DriveInputs ProcessImage::Get(size_t slave, std::span<const uint8_t> image) const {
  const std::span<const uint8_t> bytes = image.subspan(inputs_at(slave), inputs_of(slave));
  DriveInputs inputs;
  inputs.mode = kModeCyclicTorque;
  const auto get = [&](uint16_t index, auto* value) {
    const Entry* entry = slaves_[slave].tx.Find(index);
    if (entry == nullptr) return;
    using Value = std::remove_pointer_t<decltype(value)>;
    *value = static_cast<Value>(GetSized(bytes, entry->bit / 8, sizeof(Value)));
  };
  get(object::kStatusword, &inputs.statusword);
  get(object::kModeDisplay, &inputs.mode);
  get(object::kPosition, &inputs.position);
  get(object::kVelocity, &inputs.velocity);
  get(object::kTorque, &inputs.torque);
  return inputs;
}

std::optional<ProcessImage::Place> ProcessImage::FindInput(size_t slave, uint16_t index,
                                                           uint8_t subindex) const {
  const Entry* entry = slaves_[slave].tx.Find(index, subindex);
  if (entry == nullptr) return std::nullopt;
  return Place{.bit = 8 * inputs_at(slave) + entry->bit, .bits = entry->bits};
}

void ProcessImage::Configure(size_t slave, int outputs, int inputs, SlaveAccess* access) const {
  const auto assign = [](int manager) { return static_cast<uint16_t>(object::kAssign + manager); };
  ConfigureDirection(slaves_[slave].rx, assign(outputs), slaves_[slave].fixed, access);
  ConfigureDirection(slaves_[slave].tx, assign(inputs), slaves_[slave].fixed, access);
}

void ProcessImage::ConfigureDirection(const Direction& direction, uint16_t assign, bool fixed,
                                      SlaveAccess* access) {
  if (direction.entries.empty() || Mapped(direction, assign, access)) return;
  // The order that ETG.1000.6 demands: count 0, entries, count.
  access->Download({assign, 0}, 0, 1);
  if (!fixed) {
    for (const uint16_t pdo : direction.pdos) {
      access->Download({pdo, 0}, 0, 1);
      uint8_t subindex = 0;
      for (const Entry& entry : direction.entries) {
        if (entry.pdo != pdo) continue;
        const uint32_t mapping =
            uint32_t{entry.index} << 16 | uint32_t{entry.subindex} << 8 | entry.bits;
        access->Download({pdo, ++subindex}, mapping, 4);
      }
      access->Download({pdo, 0}, subindex, 1);
    }
  }
  uint8_t count = 0;
  for (const uint16_t pdo : direction.pdos) access->Download({assign, ++count}, pdo, 2);
  access->Download({assign, 0}, count, 1);
  if (!Mapped(direction, assign, access)) {
    access->Fail("{} the mapping of PDO {:04X}{}",
                 fixed ? "its own mapping is another than" : "accepts", direction.pdos.front(),
                 fixed ? " in the configuration; `poise drives scan` writes what it has"
                       : " but does not keep it; does the drive allow that PDO to be mapped?");
  }
}

bool ProcessImage::Mapped(const Direction& direction, uint16_t assign, SlaveAccess* access) {
  if (access->Upload({assign, 0}) != direction.pdos.size()) return false;
  for (size_t i = 0; i < direction.pdos.size(); ++i) {
    const uint16_t pdo = direction.pdos[i];
    if (access->Upload({assign, static_cast<uint8_t>(i + 1)}) != pdo) return false;
    uint8_t subindex = 0;
    const uint32_t count = access->Upload({pdo, 0});
    for (const Entry& entry : direction.entries) {
      if (entry.pdo != pdo) continue;
      if (subindex == count) return false;
      const uint32_t mapping = access->Upload({pdo, ++subindex});
      if (mapping >> 16 != entry.index || (mapping >> 8 & 0xFF) != entry.subindex ||
          (mapping & 0xFF) != entry.bits) {
        return false;
      }
    }
    if (subindex != count) return false;
  }
  return true;
}

}  // namespace poise::ethercat
