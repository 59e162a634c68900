// Registers, states and constants of an EtherCAT slave controller (ESC; ETG.1000.4, .6, ETG.2010).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace poise::ethercat {

namespace reg {
inline constexpr uint16_t kType = 0x0000;
inline constexpr uint16_t kFmmuCount = 0x0004;
inline constexpr uint16_t kSyncManagerCount = 0x0005;
inline constexpr uint16_t kRamSize = 0x0006;  ///< KiB
inline constexpr uint16_t kPortDescriptor = 0x0007;
inline constexpr uint16_t kFeatures = 0x0008;
inline constexpr uint16_t kStationAddress = 0x0010;
inline constexpr uint16_t kStationAlias = 0x0012;
inline constexpr uint16_t kDlControl = 0x0100;     ///< bit 0: frames of other types are destroyed
inline constexpr uint16_t kLoopControl = 0x0101;   ///< two bits a port, 0: automatic
inline constexpr uint16_t kAliasControl = 0x0103;  ///< bit 0: the station alias is an address too
inline constexpr uint16_t kDlStatus = 0x0110;
inline constexpr uint16_t kAlControl = 0x0120;
inline constexpr uint16_t kAlStatus = 0x0130;
inline constexpr uint16_t kAlStatusCode = 0x0134;
inline constexpr uint16_t kEventMask = 0x0200;      ///< of the event bits in each datagram
inline constexpr uint16_t kReceiveErrors = 0x0300;  ///< a port: invalid frames, physical errors
inline constexpr uint16_t kForwardedErrors = 0x0308;
inline constexpr uint16_t kUnitErrors = 0x030C;
inline constexpr uint16_t kLostLinks = 0x0310;        ///< a byte a port
inline constexpr uint16_t kWatchdogDivider = 0x0400;  ///< of 25 MHz, minus 2
inline constexpr uint16_t kWatchdogPdi = 0x0410;
inline constexpr uint16_t kWatchdogProcessData = 0x0420;  ///< units of the divider
inline constexpr uint16_t kWatchdogStatus = 0x0440;       ///< bit 0: not expired
inline constexpr uint16_t kWatchdogCounter = 0x0442;
inline constexpr uint16_t kEepromConfig = 0x0500;
inline constexpr uint16_t kEepromControl = 0x0502;
inline constexpr uint16_t kEepromAddress = 0x0504;  ///< in 16-bit words
inline constexpr uint16_t kEepromData = 0x0508;
inline constexpr uint16_t kFmmu = 0x0600;           ///< 16 bytes each
inline constexpr uint16_t kSyncManager = 0x0800;    ///< 8 bytes each
inline constexpr uint16_t kDcReceiveTime = 0x0900;  ///< four ports, 4 bytes each; a write latches
inline constexpr uint16_t kDcSystemTime = 0x0910;   ///< ns; a write compares and steers
inline constexpr uint16_t kDcReceiveTimeUnit = 0x0918;  ///< ns, local, of the latching write
inline constexpr uint16_t kDcOffset = 0x0920;
inline constexpr uint16_t kDcDelay = 0x0928;
inline constexpr uint16_t kDcDifference = 0x092C;  ///< sign and magnitude
inline constexpr uint16_t kDcSpeedStart = 0x0930;
inline constexpr uint16_t kDcTimeFilter = 0x0934;
inline constexpr uint16_t kDcSpeedFilter = 0x0935;
inline constexpr uint16_t kDcCyclicUnit = 0x0980;
inline constexpr uint16_t kDcActivation = 0x0981;  ///< bit 0: cyclic unit, bit 1: SYNC0
inline constexpr uint16_t kDcStart = 0x0990;
inline constexpr uint16_t kDcSync0Cycle = 0x09A0;
inline constexpr uint16_t kRam = 0x1000;  ///< start of the process data RAM
}  // namespace reg

inline constexpr uint8_t kFeatureClock = 0x04, kFeature64Bits = 0x08;  ///< distributed clock

inline constexpr int kNumPorts = 4;
inline constexpr int kNumFmmus = 8;
inline constexpr int kNumSyncManagers = 8;
inline constexpr uint16_t kFmmuSize = 16;
inline constexpr uint16_t kSyncManagerSize = 8;

/// Sync managers' customary use.
enum SyncManager { kMailboxOut = 0, kMailboxIn = 1, kProcessOut = 2, kProcessIn = 3 };

// Sync manager control byte and status (ETG.1000.4, 6.7).
inline constexpr uint8_t kSmMailboxOut = 0x26;  ///< mailbox, master writes
inline constexpr uint8_t kSmMailboxIn = 0x22;   ///< mailbox, master reads
inline constexpr uint8_t kSmProcessOut = 0x64;  ///< three buffers, master writes, watchdog
inline constexpr uint8_t kSmProcessIn = 0x20;   ///< three buffers, master reads
inline constexpr uint8_t kSmModeMask = 0x03;
inline constexpr uint8_t kSmModeMailbox = 0x02;
inline constexpr uint8_t kSmMasterWrites = 0x04;
inline constexpr uint8_t kSmWatchdog = 0x40;
inline constexpr uint8_t kSmStatusFull = 0x08;
inline constexpr uint8_t kSmEnable = 0x01;         ///< activate byte
inline constexpr uint8_t kSmRepeatRequest = 0x02;  ///< activate byte, a toggle; PDI byte: its ack
inline constexpr uint8_t kSmPdiDisable = 0x01;     ///< PDI control byte

inline constexpr uint8_t kFmmuRead = 0x01;
inline constexpr uint8_t kFmmuWrite = 0x02;

// EEPROM configuration, 0x0500: whose the EEPROM is.
inline constexpr uint8_t kEepromMaster = 0x00, kEepromApplication = 0x01, kEepromForce = 0x02;
inline constexpr uint16_t kEepromReadCommand = 0x0100;
inline constexpr uint16_t kEepromBusy = 0x8000;
inline constexpr uint16_t kEepromErrors = 0x7800;
inline constexpr uint16_t kEeprom8Bytes = 0x0040;

/// Word addresses in the slave information interface (SII, ETG.2010).
namespace sii {
inline constexpr uint16_t kVendor = 0x08, kProduct = 0x0A, kRevision = 0x0C, kSerial = 0x0E;
inline constexpr uint16_t kAlias = 0x04;
inline constexpr uint16_t kChecksum = 0x07;  ///< of the words before it, in the low byte
inline constexpr uint16_t kMailboxOutOffset = 0x18, kMailboxInOffset = 0x1A;  ///< size: next word
inline constexpr uint16_t kMailboxProtocols = 0x1C;
inline constexpr uint16_t kProtocolCoe = 0x0004;
inline constexpr uint16_t kSize = 0x3E;        ///< KiBit, less one
inline constexpr uint16_t kVersion = 0x3F;     ///< 1
inline constexpr uint16_t kCategories = 0x40;  ///< first category: type, words that follow
inline constexpr uint16_t kCategoryStrings = 10, kCategoryGeneral = 30, kCategoryFmmu = 40,
                          kCategorySyncManagers = 41;
inline constexpr uint16_t kCategoryEnd = 0xFFFF;
}  // namespace sii

enum class AlState : uint8_t { kInit = 1, kPreOp = 2, kBoot = 3, kSafeOp = 4, kOp = 8 };
inline constexpr uint8_t kAlStateMask = 0x0F;
inline constexpr uint8_t kAlIdentification = 0x20;  ///< request and answer of the identification
inline constexpr uint8_t kAlError = 0x10;           ///< in the status; in the control: acknowledge

/// AL status codes that a drive gives (ETG.1000.6, table 11).
enum class AlStatusCode : uint16_t {
  kNone = 0x0000,
  kInvalidStateChange = 0x0011,
  kUnknownState = 0x0012,
  kBootNotSupported = 0x0013,
  kInvalidMailboxConfiguration = 0x0016,
  kSyncManagerWatchdog = 0x001B,
  kInvalidOutputConfiguration = 0x001D,
  kInvalidInputConfiguration = 0x001E,
  kNoSync = 0x002D,
  kInvalidSync0Cycle = 0x0036,
};

/// What a standard calls one of its codes.
struct CodeText {
  uint32_t code;
  std::string_view text;
};
/// The text of a code; `unknown` when it is none of these.
std::string_view TextOf(std::span<const CodeText> texts, uint32_t code, std::string_view unknown);
/// "INIT", "PRE-OP", "BOOT", "SAFE-OP", "OP"; "unknown". Takes the state without the error bit.
std::string_view Name(AlState state);
/// Text of any AL status code; "unknown AL status code" when it is none of the standard's.
std::string_view AlStatusText(uint16_t code);

}  // namespace poise::ethercat
