#include "hw_bridge/ethercat/registers.h"

namespace poise::ethercat {

std::string_view TextOf(std::span<const CodeText> texts, uint32_t code, std::string_view unknown) {
  for (const CodeText& each : texts) {
    if (each.code == code) return each.text;
  }
  return unknown;
}

std::string_view Name(AlState state) {
  constexpr CodeText kNames[] = {
      {1, "INIT"}, {2, "PRE-OP"}, {3, "BOOT"}, {4, "SAFE-OP"}, {8, "OP"}};
  return TextOf(kNames, static_cast<uint32_t>(state), "unknown");
}

std::string_view AlStatusText(uint16_t code) {
  constexpr CodeText kTexts[] = {
      {0x0000, "no error"},
      {0x0001, "unspecified error"},
      {0x0002, "no memory"},
      {0x0003, "invalid device setup"},
      {0x0011, "invalid requested state change"},
      {0x0012, "unknown requested state"},
      {0x0013, "bootstrap not supported"},
      {0x0014, "no valid firmware"},
      {0x0015, "invalid mailbox configuration (BOOT)"},
      {0x0016, "invalid mailbox configuration (PRE-OP)"},
      {0x0017, "invalid sync manager configuration"},
      {0x0018, "no valid inputs available"},
      {0x0019, "no valid outputs"},
      {0x001A, "synchronization error"},
      {0x001B, "sync manager watchdog"},
      {0x001C, "invalid sync manager types"},
      {0x001D, "invalid output configuration"},
      {0x001E, "invalid input configuration"},
      {0x001F, "invalid watchdog configuration"},
      {0x0020, "slave needs cold start"},
      {0x0021, "slave needs INIT"},
      {0x0022, "slave needs PRE-OP"},
      {0x0023, "slave needs SAFE-OP"},
      {0x0024, "invalid input mapping"},
      {0x0025, "invalid output mapping"},
      {0x0026, "inconsistent settings"},
      {0x0027, "free run not supported"},
      {0x0028, "synchronization not supported"},
      {0x0029, "free run needs three buffer mode"},
      {0x002A, "background watchdog"},
      {0x002B, "no valid inputs and outputs"},
      {0x002C, "fatal sync error"},
      {0x002D, "no sync error"},
      {0x002E, "cycle time too small"},
      {0x0030, "invalid DC SYNC configuration"},
      {0x0031, "invalid DC latch configuration"},
      {0x0032, "PLL error"},
      {0x0033, "DC sync IO error"},
      {0x0034, "DC sync timeout error"},
      {0x0035, "DC invalid sync cycle time"},
      {0x0036, "DC invalid SYNC0 cycle time"},
      {0x0037, "DC invalid SYNC1 cycle time"},
      {0x0041, "mailbox AoE"},
      {0x0042, "mailbox EoE"},
      {0x0043, "mailbox CoE"},
      {0x0044, "mailbox FoE"},
      {0x0045, "mailbox SoE"},
      {0x004F, "mailbox VoE"},
      {0x0050, "EEPROM no access"},
      {0x0051, "EEPROM error"},
      {0x0060, "slave restarted locally"},
      {0x0061, "device identification value updated"},
      {0x00F0, "application controller available"},
  };
  return TextOf(kTexts, code, "unknown AL status code");
}

}  // namespace poise::ethercat
