// ProcessImage: where each mapped object of each drive lies in the cyclic datagram.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hw_bridge/ethercat/ethercat.pb.h"
#include "hw_bridge/ethercat/slave_access.h"

namespace poise::ethercat {

/// Objects of CiA 402 that the bridge exchanges cyclically.
namespace object {
inline constexpr uint16_t kErrorCode = 0x603F;
inline constexpr uint16_t kControlword = 0x6040;
inline constexpr uint16_t kStatusword = 0x6041;
inline constexpr uint16_t kModeOfOperation = 0x6060;
inline constexpr uint16_t kModeDisplay = 0x6061;
inline constexpr uint16_t kPosition = 0x6064;
inline constexpr uint16_t kVelocity = 0x606C;
inline constexpr uint16_t kTargetTorque = 0x6071;  ///< per mille of rated
inline constexpr uint16_t kMaxTorque = 0x6072;     ///< per mille of rated
inline constexpr uint16_t kRatedCurrent = 0x6075;  ///< mA
inline constexpr uint16_t kRatedTorque = 0x6076;   ///< mN·m
inline constexpr uint16_t kTorque = 0x6077;        ///< per mille of rated
inline constexpr uint16_t kTargetPosition = 0x607A;
inline constexpr uint16_t kTargetVelocity = 0x60FF;
inline constexpr uint16_t kSupportedModes = 0x6502;  ///< bit 9: cyclic synchronous torque
inline constexpr uint16_t kRxAssign = 0x1C12, kTxAssign = 0x1C13;
}  // namespace object

inline constexpr int8_t kModeCyclicTorque = 10;

/// What the bridge tells a drive in a cycle.
struct DriveOutputs {
  uint16_t controlword = 0;
  int8_t mode = kModeCyclicTorque;
  int16_t target_torque = 0;  ///< per mille of rated
  uint16_t max_torque = 0;    ///< per mille of rated
  int32_t target_position = 0, target_velocity = 0;
};

/// What a drive reports in a cycle.
struct DriveInputs {
  uint16_t statusword = 0;
  int8_t mode = 0;
  int32_t position = 0;  ///< counts, wraps around
  int32_t velocity = 0;  ///< counts/s
  int16_t torque = 0;    ///< per mille of rated
};

/// Outputs of all drives, then inputs of all drives, drive by drive without gaps.
class ProcessImage {
 public:
  /// Throws EthercatError: no objects, sizes that do not suit them, an object missing without which
  /// a drive in cyclic synchronous torque cannot be controlled (6040 6060 6071 6072 and 6041 6061
  /// 6064 6077), more than one datagram carries.
  ProcessImage(const DriveProfile& profile, int num_drives);

  size_t outputs_per_drive() const { return rx_.size; }
  size_t inputs_per_drive() const { return tx_.size; }
  size_t outputs_size() const { return rx_.size * num_drives_; }
  size_t size() const { return (rx_.size + tx_.size) * num_drives_; }
  /// Offset of a drive's outputs or inputs in the image.
  size_t outputs_at(size_t drive) const { return rx_.size * drive; }
  size_t inputs_at(size_t drive) const { return outputs_size() + tx_.size * drive; }

  /// Precondition of both: `image` has size() bytes. Objects that are not mapped are left out.
  void Put(size_t drive, const DriveOutputs& outputs, std::span<uint8_t> image) const;
  DriveInputs Get(size_t drive, std::span<const uint8_t> image) const;

  /// Makes a slave in PRE-OP map these objects, by SDO, and reads back that it does.
  void Configure(SlaveAccess* slave) const;

 private:
  struct Entry {
    uint16_t index;
    uint8_t subindex;
    uint8_t bits;
    size_t offset;  // in the PDO, bytes
  };
  struct Pdo {
    uint16_t index = 0, assign = 0;
    std::vector<Entry> entries;
    size_t size = 0;  // bytes
  };

  static Pdo MakePdo(const google::protobuf::RepeatedPtrField<MappedObject>& objects,
                     uint32_t index, uint16_t assign, const std::string& profile);
  static void ConfigurePdo(const Pdo& pdo, SlaveAccess* slave);
  static bool Mapped(const Pdo& pdo, SlaveAccess* slave);

  Pdo rx_, tx_;
  size_t num_drives_;
};

}  // namespace poise::ethercat
