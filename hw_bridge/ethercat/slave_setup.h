// SlaveSetup: leads one slave from INIT to where it takes process data, as it is configured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hw_bridge/ethercat/ethercat.pb.h"
#include "hw_bridge/ethercat/process_image.h"
#include "hw_bridge/ethercat/slave_access.h"

namespace poise::ethercat {

/// Logical address of the process image's first byte.
inline constexpr uint32_t kLogicalStart = 0x00010000;

/// What the configuration says of a slave, be it a drive or another.
struct ConfiguredSlave {
  std::string name;
  const DriveProfile* profile;
  const DriveConfig* drive = nullptr;                                    ///< nullptr: it is none
  std::optional<uint32_t> serial = {}, identification = {}, alias = {};  ///< nullopt: any will do
  /// Values that it is told at start-up, in this order.
  std::vector<const google::protobuf::RepeatedPtrField<SdoValue>*> sdo = {};
};

/// Slaves are counted as in the process image: the drives, then the others. Every function throws
/// EthercatError with the slave, the object or register, and what to do.
class SlaveSetup {
 public:
  /// Both must outlive this.
  SlaveSetup(const MasterConfig* config, const ProcessImage* image);

  const ConfiguredSlave& slave(size_t slave) const { return slaves_[slave]; }

  /// Reads the identity of a slave in INIT, which must be the configured one.
  void Check(size_t slave, SlaveAccess* access) const;
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
  std::vector<ConfiguredSlave> slaves_;
};

/// The bytes of a configured value. Throws EthercatError: it does not fit its type.
std::vector<uint8_t> BytesOf(const SdoValue& value);

}  // namespace poise::ethercat
