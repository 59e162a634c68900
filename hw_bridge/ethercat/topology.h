// How slaves are wired: who follows at which port, and how long a frame takes to each.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "hw_bridge/ethercat/registers.h"

namespace poise::ethercat {

/// In which a frame passes a slave's ports.
inline constexpr std::array<int, kNumPorts> kFrameOrder = {0, 3, 1, 2};

/// What a slave shows of its ports. Receive times: when one broadcast write passed each port, ns of
/// the slave's own clock, modulo 2^32.
struct SlavePorts {
  uint16_t dl_status = 0;  ///< register 0x0110
  bool has_times = false;
  std::array<uint32_t, kNumPorts> times{};

  /// Communication on a port: something follows there, or comes from there.
  bool active(int port) const { return (dl_status >> (9 + 2 * port) & 1) != 0; }
};

/// A slave's place in the tree.
struct SlavePlace {
  int parent = -1;       ///< position in the chain; -1: the master
  int parent_port = -1;  ///< at which it hangs
  int32_t delay = 0;     ///< ns, from the first slave with a clock to this one
};

/// By chain position, as frames meet the slaves: at each, ports in the order 0, 3, 1, 2
/// (ETG.1000.4; Beckhoff's ESC data sheet, section I). Delays: half of what a branch's round trip
/// takes beyond that of the slave at its end, plus what branches before it take. `describe` names a
/// position. Throws EthercatError: a slave that frames enter at another port than 0 (IN and OUT are
/// swapped), ports that do not fit the number of slaves.
std::vector<SlavePlace> FindTopology(std::span<const SlavePorts> slaves,
                                     const std::function<std::string(int)>& describe);

}  // namespace poise::ethercat
