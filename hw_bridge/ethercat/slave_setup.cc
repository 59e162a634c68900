#include "hw_bridge/ethercat/slave_setup.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

namespace poise::ethercat {
namespace {

constexpr uint16_t kWatchdogDivider = 2498;  // 100 us
constexpr uint32_t kWatchdogUnitsPerMs = 10;
constexpr uint8_t kTypeOutputs = 3, kTypeInputs = 4;  // of the EEPROM's sync managers

/// The first sync manager of a type; `customary` where the EEPROM names none.
int ManagerOf(const std::array<SyncManagerEntry, kNumSyncManagers>& managers, uint8_t type,
              int customary) {
  for (size_t i = 0; i < managers.size(); ++i) {
    if (managers[i].type == type) return static_cast<int>(i);
  }
  return customary;
}

}  // namespace

std::vector<uint8_t> BytesOf(const SdoValue& value) {
  constexpr std::pair<size_t, bool> kTypes[] = {{1, false}, {1, true},  {2, false},
                                                {2, true},  {4, false}, {4, true}};
  if (value.type() == SdoValue::TEXT) return {value.text().begin(), value.text().end()};
  if (value.type() == SdoValue::BYTES) return {value.data().begin(), value.data().end()};
  const auto [size, is_signed] = kTypes[value.type()];
  const int64_t range = int64_t{1} << (8 * size);
  const int64_t least = is_signed ? -range / 2 : 0, most = is_signed ? range / 2 - 1 : range - 1;
  if (!value.has_value() || value.value() < least || value.value() > most) {
    throw EthercatError(
        "EtherCAT configuration: sdo {:04X}:{:02X}: value must be between {} and {} for its type",
        value.index(), value.subindex(), least, most);
  }
  std::vector<uint8_t> bytes(size);
  PutSized(bytes, 0, static_cast<uint64_t>(value.value()), size);
  return bytes;
}

SlaveSetup::SlaveSetup(const MasterConfig* config, const ProcessImage* image)
    : config_(config), image_(image) {
  const auto given = [](bool has, uint32_t value) {
    return has ? std::optional(value) : std::nullopt;
  };
  const auto add = [&](const std::string& name, const DriveProfile& profile, const auto& slave) {
    slaves_.push_back({.name = name,
                       .profile = &profile,
                       .serial = given(slave.has_serial(), slave.serial()),
                       .identification = given(slave.has_identification(), slave.identification()),
                       .alias = given(slave.has_alias(), slave.alias()),
                       .sdo = {&profile.sdo(), &slave.sdo()}});
  };
  for (const DriveConfig& drive : config->drive()) {
    add(drive.joint(), drive.has_profile() ? drive.profile() : config->profile(), drive);
    ConfiguredSlave& slave = slaves_.back();
    slave.drive = &drive;
    slave.sdo.insert(slave.sdo.begin() + 1, &config->sdo());
  }
  for (const OtherSlave& other : config->other()) add(other.name(), other.profile(), other);
}

void SlaveSetup::Check(size_t slave, SlaveAccess* access) const {
  const DriveProfile& profile = *slaves_[slave].profile;
  const Identity identity = access->ReadIdentity();
  const auto compare = [&](std::string_view what, uint32_t found, uint32_t wanted) {
    if (found == wanted) return;
    access->Fail(
        "its {} is 0x{:08X}, that of \"{}\" 0x{:08X}; is this the right drive at this place?", what,
        found, profile.name(), wanted);
  };
  compare("vendor", identity.vendor, profile.vendor_id());
  compare("product code", identity.product, profile.product_code());
  if (profile.has_revision()) compare("revision", identity.revision, profile.revision());
  if (const auto& serial = slaves_[slave].serial)
    compare("serial number", identity.serial, *serial);
}

void SlaveSetup::Configure(size_t slave, SlaveAccess* access) const {
  const bool mailbox = access->SetUpMailbox();
  const DriveConfig* const drive = slaves_[slave].drive;
  if (!mailbox && drive != nullptr) {
    access->Fail("its EEPROM offers no CoE mailbox; a drive of CiA 402 has one");
  }
  const auto managers = access->ReadSyncManagers();
  access->ReleaseEeprom();
  access->ChangeState(AlState::kPreOp);
  if (mailbox) {
    if (drive != nullptr) CheckRatings(slave, access);
    WriteValues(slave, access);
    image_->Configure(slave, ManagerOf(managers, kTypeOutputs, kProcessOut),
                      ManagerOf(managers, kTypeInputs, kProcessIn), access);
    if (drive != nullptr) SetTorqueMode(slave, access);
  }
  SetUpProcessData(slave, managers, access);
}

void SlaveSetup::CheckRatings(size_t slave, SlaveAccess* access) const {
  const DriveProfile& profile = *slaves_[slave].profile;
  const DriveConfig& expected = *slaves_[slave].drive;
  const auto rated = [&](std::string_view field, ObjectAddress object, uint32_t wanted,
                         double unit_size, std::string_view unit) {
    const double found = access->Upload(object) * unit_size;
    if (std::llround(found) == wanted) return;
    access->Fail(
        "object {:04X} ({}) is {} {}, the configuration says {} {}; every torque would be wrong by "
        "that ratio: set up the drive or the configuration",
        object.index, field, found, unit, wanted, unit);
  };
  rated("rated_torque", {object::kRatedTorque, 0}, expected.rated_torque(),
        profile.rated_torque_unit(), "mN·m");
  rated("rated_current",
        {static_cast<uint16_t>(profile.rated_current_index()),
         static_cast<uint8_t>(profile.rated_current_subindex())},
        expected.rated_current(), 1, "mA");
  const uint32_t modes = access->Upload({object::kSupportedModes, 0});
  if ((modes >> (kModeCyclicTorque - 1) & 1) == 0) {
    access->Fail("object {:04X} (supported modes) is 0x{:08X}, without cyclic synchronous torque",
                 object::kSupportedModes, modes);
  }
}

void SlaveSetup::WriteValues(size_t slave, SlaveAccess* access) const {
  for (const auto* values : slaves_[slave].sdo) {
    for (const SdoValue& value : *values) {
      access->DownloadBytes(
          {static_cast<uint16_t>(value.index()), static_cast<uint8_t>(value.subindex())},
          BytesOf(value), value.complete_access());
    }
  }
}

void SlaveSetup::SetTorqueMode(size_t slave, SlaveAccess* access) const {
  // What the process data lack is set once, here.
  const DriveConfig& drive = *slaves_[slave].drive;
  if (!image_->Sends(slave, object::kMaxTorque) && drive.has_max_torque()) {
    try {
      access->Download({object::kMaxTorque, 0}, drive.max_torque(), 2);
    } catch (const SdoAbortError& error) {
      // A drive without the object has a limit of its own.
      if (error.code() != static_cast<uint32_t>(SdoAbort::kNoObject)) throw;
      fmt::print(stderr,
                 "warning: {}: has no object {:04X}: it does not keep torque within max_torque, {} "
                 "per mille of its rating; only its own limit does\n",
                 access->Describe(), object::kMaxTorque, drive.max_torque());
    }
  }
  if (image_->Sends(slave, object::kModeOfOperation) &&
      image_->Reports(slave, object::kModeDisplay)) {
    return;
  }
  access->Download({object::kModeOfOperation, 0}, static_cast<uint8_t>(kModeCyclicTorque), 1);
  constexpr int kLooks = 100;
  uint32_t mode = 0;
  for (int i = 0; i < kLooks; ++i) {
    mode = access->Upload({object::kModeDisplay, 0});
    if (mode == static_cast<uint32_t>(kModeCyclicTorque)) return;
    access->Pause();
  }
  access->Fail(
      "object {:04X} (mode) stays {} after cyclic synchronous torque (10) was asked for, and its "
      "process data do not report it",
      object::kModeDisplay, mode);
}

void SlaveSetup::SetUpProcessData(size_t slave,
                                  const std::array<SyncManagerEntry, kNumSyncManagers>& managers,
                                  SlaveAccess* access) const {
  int fmmu = 0;
  const auto set_up = [&](uint8_t type, int customary, uint8_t control, uint8_t direction,
                          size_t image_offset, size_t size) {
    if (size == 0) return;
    const int manager = ManagerOf(managers, type, customary);
    const uint16_t start = managers[static_cast<size_t>(manager)].start;
    if (start < reg::kRam) {
      access->Fail("its EEPROM gives no address for sync manager {}", manager);
    }
    access->SetSyncManager(manager, start, static_cast<uint16_t>(size), control);
    std::array<uint8_t, kFmmuSize> map{};
    Put<uint32_t>(map, 0, kLogicalStart + static_cast<uint32_t>(image_offset));
    Put<uint16_t>(map, 4, static_cast<uint16_t>(size));
    map[7] = 7;  // the last bit of the last byte
    Put<uint16_t>(map, 8, start);
    map[11] = direction;
    map[12] = 1;
    access->Write(static_cast<uint16_t>(reg::kFmmu + fmmu++ * kFmmuSize), map);
  };
  set_up(kTypeOutputs, kProcessOut, kSmProcessOut, kFmmuWrite, image_->outputs_at(slave),
         image_->outputs_of(slave));
  set_up(kTypeInputs, kProcessIn, kSmProcessIn, kFmmuRead, image_->inputs_at(slave),
         image_->inputs_of(slave));
  if (image_->outputs_of(slave) == 0) return;
  access->Write<uint16_t>(reg::kWatchdogDivider, kWatchdogDivider);
  access->Write<uint16_t>(reg::kWatchdogProcessData,
                          static_cast<uint16_t>(config_->watchdog() * kWatchdogUnitsPerMs));
}

}  // namespace poise::ethercat
