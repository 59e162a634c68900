#include "tools/commands/drives_scan.h"

#include <fmt/format.h>

#include "hw_bridge/ethercat/distributed_clocks.h"
#include "hw_bridge/ethercat/process_image.h"
#include "hw_bridge/ethercat/topology.h"

namespace poise {
namespace {

constexpr int64_t kFrameTimeout = 20 * ethercat::kMillisecond;
constexpr int kAttempts = 3;
constexpr ethercat::Timeouts kTimeouts = {.eeprom = 200 * ethercat::kMillisecond,
                                          .mailbox = 1000 * ethercat::kMillisecond,
                                          .state = 5000 * ethercat::kMillisecond};

/// The object's value; nullopt: the slave has none.
std::optional<uint32_t> UploadIfThere(ethercat::SlaveAccess* slave,
                                      ethercat::ObjectAddress address) {
  try {
    return slave->Upload(address);
  } catch (const ethercat::SdoAbortError&) {
    return std::nullopt;
  }
}

void ReadMapping(ethercat::SlaveAccess* slave, uint16_t assign, std::vector<uint32_t>* entries,
                 std::vector<uint16_t>* pdos) {
  const uint32_t count = UploadIfThere(slave, {assign, 0}).value_or(0);
  for (uint32_t i = 1; i <= count; ++i) {
    const auto pdo = static_cast<uint16_t>(slave->Upload({assign, static_cast<uint8_t>(i)}));
    const uint32_t objects = slave->Upload({pdo, 0});
    for (uint32_t k = 1; k <= objects; ++k) {
      entries->push_back(slave->Upload({pdo, static_cast<uint8_t>(k)}));
      pdos->push_back(pdo);
    }
  }
}

/// What of a name can stand in a text file's quotes.
std::string QuotableName(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (c >= ' ' && c < 0x7F && c != '"' && c != '\\') text += c;
  }
  return text;
}

ScannedSlave ReadSlave(ethercat::SlaveAccess* slave) {
  ScannedSlave found;
  found.identity = slave->ReadIdentity();
  found.alias = slave->Read<uint16_t>(ethercat::reg::kStationAlias);
  found.identification = slave->ReadIdentification();
  found.name = QuotableName(slave->ReadName());
  if (!slave->SetUpMailbox()) return found;
  slave->ReleaseEeprom();
  slave->ChangeState(ethercat::AlState::kPreOp);
  try {
    const std::vector<uint8_t> bytes = slave->UploadBytes({0x1008, 0});
    const std::string name = QuotableName({bytes.begin(), bytes.end()});
    if (!name.empty()) found.name = name;
  } catch (const ethercat::SdoAbortError&) {
    // A slave need not have the object.
  }
  const uint32_t modes = UploadIfThere(slave, {ethercat::object::kSupportedModes, 0}).value_or(0);
  found.is_drive = (modes >> (ethercat::kModeCyclicTorque - 1) & 1) != 0;
  found.rated_torque = UploadIfThere(slave, {ethercat::object::kRatedTorque, 0});
  found.rated_current = UploadIfThere(slave, {ethercat::object::kRatedCurrent, 0});
  ReadMapping(slave, ethercat::object::kRxAssign, &found.rx, &found.rx_pdo);
  ReadMapping(slave, ethercat::object::kTxAssign, &found.tx, &found.tx_pdo);
  slave->ChangeState(ethercat::AlState::kInit);
  return found;
}

std::string ProfileText(const ScannedSlave& slave, const std::string& indent) {
  std::string text = fmt::format("{}profile {{\n{}  name: \"{}\"\n", indent, indent,
                                 slave.name.empty() ? "unnamed" : slave.name);
  text += fmt::format("{}  vendor_id: 0x{:08X}\n{}  product_code: 0x{:08X}\n", indent,
                      slave.identity.vendor, indent, slave.identity.product);
  text += fmt::format("{}  fixed_mapping: true  # as it is; take it away to have another written\n",
                      indent);
  const auto entries = [&](const char* field, const std::vector<uint32_t>& mapping,
                           const std::vector<uint16_t>& pdos) {
    for (size_t i = 0; i < mapping.size(); ++i) {
      const uint32_t subindex = mapping[i] >> 8 & 0xFF;
      text += fmt::format(
          "{}  {} {{ index: 0x{:04X}{} bits: {}{} }}\n", indent, field, mapping[i] >> 16,
          subindex != 0 ? fmt::format(" subindex: {}", subindex) : "", mapping[i] & 0xFF,
          i == 0 || pdos[i] != pdos[i - 1] ? fmt::format(" pdo: 0x{:04X}", pdos[i]) : "");
    }
  };
  entries("rx", slave.rx, slave.rx_pdo);
  entries("tx", slave.tx, slave.tx_pdo);
  return text + indent + "}\n";
}

}  // namespace

std::vector<ScannedSlave> ScanChain(ethercat::Link* link) {
  ethercat::Transactions transactions(link, kFrameTimeout, kAttempts);
  std::array<uint8_t, 2> status{};
  const auto count =
      transactions.Execute(ethercat::Command::kBrd, 0, ethercat::reg::kAlStatus, status);
  if (!count) {
    throw ethercat::EthercatError(
        "no frame comes back; is the cable in, the chain powered, the link the right one?");
  }
  if (*count == 0) {
    throw ethercat::EthercatError(
        "frames come back, but no slave has touched them; does a switch or a loop send them back?");
  }
  std::array<uint8_t, 2> init{};
  ethercat::Put<uint16_t>(init, 0,
                          static_cast<uint16_t>(ethercat::AlState::kInit) | ethercat::kAlError);
  static_cast<void>(
      transactions.Execute(ethercat::Command::kBwr, 0, ethercat::reg::kAlControl, init));
  std::array<uint8_t, ethercat::kNumSyncManagers * ethercat::kSyncManagerSize> zeros{};
  static_cast<void>(
      transactions.Execute(ethercat::Command::kBwr, 0, ethercat::reg::kSyncManager, zeros));
  ethercat::LatchClocks(&transactions);
  std::vector<ethercat::SlaveAccess> slaves;
  std::vector<ethercat::SlavePorts> ports;
  for (int i = 0; i < *count; ++i) {
    ethercat::SlaveAccess& slave = slaves.emplace_back(&transactions, kTimeouts, i);
    static_cast<void>(slave.AssignStation());
    slave.AwaitInit();
    ports.push_back(slave.ReadPorts());
  }
  const auto places = ethercat::FindTopology(
      ports, [&](int position) { return slaves[static_cast<size_t>(position)].Describe(); });
  std::vector<ScannedSlave> found;
  for (size_t i = 0; i < slaves.size(); ++i) {
    found.push_back(ReadSlave(&slaves[i]));
    found.back().parent = places[i].parent;
    found.back().parent_port = places[i].parent_port;
  }
  return found;
}

std::string ConfigurationOf(const std::vector<ScannedSlave>& slaves) {
  std::string text =
      "# proto-message: poise.ethercat.MasterConfig (hw_bridge/ethercat/ethercat.proto)\n"
      "# Written by poise drives scan: what is on the chain. Name the joints, and see which of "
      "the\n"
      "# mappings carry what the bridge needs (6040 6071; 6041 6064 6077).\n";
  for (size_t i = 0; i < slaves.size(); ++i) {
    const ScannedSlave& slave = slaves[i];
    text += fmt::format(
        "\n# {}: {}, serial {}, revision 0x{:08X}{}{}\n", i,
        slave.name.empty() ? "no name" : slave.name, slave.identity.serial, slave.identity.revision,
        slave.parent < 0 ? ""
                         : fmt::format(", at port {} of slave {}", slave.parent_port, slave.parent),
        slave.is_drive ? "" : ", no drive with cyclic synchronous torque");
    std::string fields;
    if (slave.identity.serial != 0) fields += fmt::format("  serial: {}\n", slave.identity.serial);
    if (slave.identification) {
      fields += fmt::format("  identification: {}\n", *slave.identification);
    } else if (slave.alias != 0) {
      fields += fmt::format("  alias: {}\n", slave.alias);
    }
    if (slave.is_drive) {
      text += fmt::format("drive {{\n  joint: \"joint_{}\"\n{}", i, fields);
      if (slave.rated_torque) {
        text += fmt::format("  rated_torque: {}  # 6076, as it counts\n", *slave.rated_torque);
      }
      if (slave.rated_current) text += fmt::format("  rated_current: {}\n", *slave.rated_current);
    } else {
      text += fmt::format("other {{\n  name: \"slave_{}\"\n  position: {}\n{}", i, i, fields);
    }
    text += ProfileText(slave, "  ") + "}\n";
  }
  return text;
}

}  // namespace poise
