// SlaveSetup: leads one slave from INIT to where it takes process data, as it is configured.
#pragma once

#include <string>

#include "hw_bridge/ethercat/ethercat.pb.h"
#include "hw_bridge/ethercat/process_image.h"
#include "hw_bridge/ethercat/slave_access.h"

namespace poise::ethercat {

/// Logical address of the process image's first byte.
inline constexpr uint32_t kLogicalStart = 0x00010000;

/// Slaves are counted as in the process image: the drives, then the others. Every function throws
/// EthercatError with the slave, the object or register, and what to do.
class SlaveSetup {
 public:
  /// Both must outlive this.
  SlaveSetup(const MasterConfig* config, const ProcessImage* image)
      : config_(config), image_(image) {}

  size_t num_drives() const { return static_cast<size_t>(config_->drive_size()); }
  bool is_drive(size_t slave) const { return slave < num_drives(); }
  std::string NameOf(size_t slave) const;
  const DriveProfile& ProfileOf(size_t slave) const;
  /// What the configuration asks of a slave; nullopt: any will do.
  std::optional<uint32_t> SerialOf(size_t slave) const;
  std::optional<uint32_t> IdentificationOf(size_t slave) const;
  std::optional<uint32_t> AliasOf(size_t slave) const;

  /// Reads the identity of a slave in INIT, which must be the configured one.
  Identity Check(size_t slave, SlaveAccess* access) const;
  /// Takes a slave from INIT to PRE-OP and sets up its process data: all that SAFE-OP takes but
  /// clocks.
  void Configure(size_t slave, SlaveAccess* access) const;

 private:
  void CheckRatings(size_t slave, SlaveAccess* access) const;
  void WriteValues(size_t slave, SlaveAccess* access) const;
  void SetTorqueMode(size_t slave, SlaveAccess* access) const;
  void SetUpProcessData(size_t slave,
                        const std::array<SyncManagerEntry, kNumSyncManagers>& managers,
                        SlaveAccess* access) const;

  const MasterConfig* config_;
  const ProcessImage* image_;
};

/// The bytes of a configured value. Throws EthercatError: it does not fit its type.
std::vector<uint8_t> BytesOf(const SdoValue& value);

}  // namespace poise::ethercat
