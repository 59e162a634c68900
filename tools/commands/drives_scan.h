// What is on an EtherCAT chain, as a configuration of the bridge.
#pragma once

#include <string>
#include <vector>

#include "hw_bridge/ethercat/links/link.h"
#include "hw_bridge/ethercat/slave_access.h"

namespace poise {

/// A slave as it was found.
struct ScannedSlave {
  ethercat::Identity identity;
  std::string name;    ///< object 1008; empty: it gives none
  uint16_t alias = 0;  ///< station alias; 0: none
  std::optional<uint32_t> identification;
  bool is_drive = false;  ///< of CiA 402, with cyclic synchronous torque
  int parent = -1, parent_port = -1;
  std::vector<uint32_t> rx, tx;                         ///< mapping entries as in 16xx and 1Axx
  std::vector<uint16_t> rx_pdo, tx_pdo;                 ///< the PDO of each entry
  std::optional<uint32_t> rated_torque, rated_current;  ///< 6076, 6075
};

/// Leads every slave to PRE-OP, reads it, and leads it back to INIT; no process data flow. Throws
/// EthercatError.
std::vector<ScannedSlave> ScanChain(ethercat::Link* link);

/// hw_bridge.ethercat.master of a chain as text, with a comment for each slave.
std::string ConfigurationOf(const std::vector<ScannedSlave>& slaves);

}  // namespace poise
