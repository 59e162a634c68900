// ProcessImage: where each mapped object of each slave lies in the cyclic datagram.
#pragma once

#include <cstdint>
#include <optional>
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
/// PDO assignment of a sync manager: this and its number.
inline constexpr uint16_t kAssign = 0x1C10;
inline constexpr uint16_t kRxAssign = 0x1C12, kTxAssign = 0x1C13;
}  // namespace object

inline constexpr int8_t kModeCyclicTorque = 10;

/// What the bridge tells a drive in a cycle.
struct DriveOutputs {
  uint16_t controlword = 0;
  int8_t mode = kModeCyclicTorque;
  int16_t target_torque = 0;  ///< per mille of rated
  uint16_t max_torque = 0;    ///< per mille of rated
};

/// What a drive reports in a cycle.
struct DriveInputs {
  uint16_t statusword = 0;
  int8_t mode = 0;
  int32_t position = 0;  ///< counts, wraps around
  int32_t velocity = 0;  ///< counts/s
  int16_t torque = 0;    ///< per mille of rated
};

/// Outputs of all slaves, then inputs of all, slave by slave without gaps: the drives first, in
/// their order, then the others.
class ProcessImage {
 public:
  /// Throws EthercatError: sizes that do not suit the objects, an object missing without which a
  /// drive in cyclic synchronous torque cannot be controlled (6040 6071 and 6041 6064 6077), more
  /// than one datagram carries.
  explicit ProcessImage(const MasterConfig& config);

  size_t num_slaves() const { return slaves_.size(); }
  size_t outputs_of(size_t slave) const { return slaves_[slave].rx.size(); }
  size_t inputs_of(size_t slave) const { return slaves_[slave].tx.size(); }
  size_t outputs_size() const { return outputs_size_; }
  size_t size() const { return size_; }
  /// Offset of a slave's outputs or inputs in the image.
  size_t outputs_at(size_t slave) const { return slaves_[slave].outputs_at; }
  size_t inputs_at(size_t slave) const { return slaves_[slave].inputs_at; }
  /// Working counters of a frame that all slaves take part in.
  uint16_t expected_read_write() const { return static_cast<uint16_t>(reads_ + 2 * writes_); }
  uint16_t expected_read() const { return static_cast<uint16_t>(reads_); }
  uint16_t expected_write() const { return static_cast<uint16_t>(writes_); }

  /// Whether the process data of a slave have an object.
  bool Sends(size_t slave, uint16_t index) const {
    return slaves_[slave].rx.Find(index) != nullptr;
  }
  bool Reports(size_t slave, uint16_t index) const {
    return slaves_[slave].tx.Find(index) != nullptr;
  }

  /// Precondition of all: `image` has size() bytes. Objects that are not mapped are left out; a
  /// mode that is not reported is the one that was asked for.
  void Put(size_t slave, const DriveOutputs& outputs, std::span<uint8_t> image) const;
  DriveInputs Get(size_t slave, std::span<const uint8_t> image) const;

  /// Bit offset in the image and bits of an object that a slave reports.
  struct Place {
    size_t bit = 0;
    uint8_t bits = 0;
  };
  std::optional<Place> FindInput(size_t slave, uint16_t index, uint8_t subindex) const;

  /// Makes a slave in PRE-OP map these objects to the process data of sync managers `outputs` and
  /// `inputs`, by SDO, and reads back that it does.
  void Configure(size_t slave, int outputs, int inputs, SlaveAccess* access) const;

 private:
  struct Entry {
    uint16_t index;
    uint8_t subindex;
    uint8_t bits;
    size_t bit;  // offset in the direction's data
    uint16_t pdo;
  };
  struct Direction {
    std::vector<Entry> entries;
    std::vector<uint16_t> pdos;  // assigned, in order
    size_t bits = 0;
    size_t size() const { return bits / 8; }
    const Entry* Find(uint16_t index, int subindex = -1) const;
  };
  struct Slave {
    Direction rx, tx;
    bool fixed = false;
    size_t outputs_at = 0, inputs_at = 0;
  };

  static Direction MakeDirection(const DriveProfile& profile, bool rx);
  static void ConfigureDirection(const Direction& direction, uint16_t assign, bool fixed,
                                 SlaveAccess* access);
  static bool Mapped(const Direction& direction, uint16_t assign, SlaveAccess* access);

  std::vector<Slave> slaves_;
  size_t outputs_size_ = 0, size_ = 0;
  int reads_ = 0, writes_ = 0;
};

}  // namespace poise::ethercat
