#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "hw_bridge/ethercat/emulator/emulated_chain.h"
#include "hw_bridge/ethercat/emulator/rotor.h"
#include "hw_bridge/ethercat/links/socket_link.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/commands/drives_scan.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

struct DrivesOptions {
  std::string link = "udp";
  int count = 12;
  std::string profile = "elmo_gold";
  double inertia = 1e-4;
  double damping = 1e-3;
  double duration = 0;
  std::string out;
};

/// "raw:eth1", "udp", "udp:PORT" or "udp:ADDRESS:PORT".
ethercat::LinkConfig ParseLink(const std::string& text) {
  ethercat::LinkConfig link;
  if (text.starts_with("raw:") && text.size() > 4) {
    link.set_interface(text.substr(4));
    return link;
  }
  if (text != "udp" && !text.starts_with("udp:")) {
    throw ConfigError(
        fmt::format("--link {}: must be udp, udp:PORT, udp:ADDRESS:PORT, or raw:INTERFACE", text));
  }
  link.mutable_udp();
  if (text == "udp") return link;
  std::string rest = text.substr(4);
  if (const size_t colon = rest.rfind(':'); colon != std::string::npos) {
    link.mutable_udp()->set_address(rest.substr(0, colon));
    rest = rest.substr(colon + 1);
  }
  const std::optional<uint32_t> port = NumberIn<uint32_t>(rest);
  if (!port) throw ConfigError(fmt::format("--link {}: the port is no number", text));
  link.mutable_udp()->set_port(*port);
  CheckFields(link, fmt::format("--link {}: ", text));
  return link;
}

ethercat::EmulatedChainConfig ChainOf(const DrivesOptions& options) {
  ethercat::DriveProfile profile;
  ReadTextProto(FindFile("drives", options.profile, std::filesystem::current_path()).string(),
                &profile);
  ethercat::EmulatedChainConfig chain;
  for (int i = 0; i < options.count; ++i) {
    ethercat::EmulatedDriveConfig& drive = *chain.add_drive();
    drive.set_vendor_id(profile.vendor_id());
    drive.set_product_code(profile.product_code());
    drive.set_serial(static_cast<uint32_t>(100 + i));
    drive.set_device_name(profile.name());
    drive.set_al_response_time(1);  // as a real one: it reads AL control when it gets to it
    drive.set_torque_unit(profile.rated_torque_unit() < 1 ? 1000 : 1);
    if (!profile.fixed_mapping()) continue;
    *drive.mutable_fixed_rx() = profile.rx();
    *drive.mutable_fixed_tx() = profile.tx();
  }
  return chain;
}

void ShowDrives(ethercat::EmulatedChain* chain, const std::vector<ethercat::Rotor>& rotors,
                int64_t frames, double seconds) {
  std::string states;
  double torque = 0, speed = 0;
  for (size_t i = 0; i < rotors.size(); ++i) {
    const ethercat::EmulatedSlave& slave = chain->slave(i);
    const std::string name(ethercat::Name(slave.al_state()));
    const std::string state =
        fmt::format("{}{} ({})", name, slave.al_error() ? " with an error" : "",
                    ethercat::Name(slave.drive().state()));
    if (i == 0) states = state;
    if (state != states) states = "differing states";
    torque = std::max(torque, std::abs(rotors[i].torque()));
    speed = std::max(speed, std::abs(rotors[i].velocity()));
  }
  fmt::print("{:6.0f} s  {:6} frames/s  {}  torque at most {:.3f} N·m, speed {:.1f} rad/s\n",
             seconds, frames, states, torque, speed);
  std::fflush(stdout);
}

int Emulate(const DrivesOptions& options) {
  CatchStopSignals();
  const auto link =
      ethercat::OpenLink(ParseLink(options.link), ethercat::SocketLink::Side::kSlaves);
  std::vector<ethercat::Rotor> rotors(static_cast<size_t>(options.count),
                                      {options.inertia, options.damping});
  std::vector<ethercat::MotorLoad*> loads;
  for (ethercat::Rotor& rotor : rotors) loads.push_back(&rotor);
  ethercat::EmulatedChain chain(ChainOf(options), loads);
  fmt::print("{} drives of type {} on {}; Ctrl-C ends them\n", options.count, options.profile,
             options.link);
  std::fflush(stdout);
  const int64_t start = link->Now();
  const auto end =
      options.duration > 0 ? start + static_cast<int64_t>(options.duration * 1e9) : INT64_MAX;
  std::array<uint8_t, ethercat::kMaxFrame> frame{};
  int64_t shown = start, frames = 0;
  while (StopSignal() == 0 && link->Now() < end) {
    const size_t size = link->Receive(frame, link->Now() + ethercat::kMillisecond);
    const int64_t now = link->Now() - start;
    const std::span<uint8_t> bytes = std::span(frame).first(size);
    chain.AdvanceTo(now);
    if (size > 0 && chain.HandleFrame(bytes, now)) static_cast<void>(link->Send(bytes));
    if (link->Now() - shown < ethercat::kSecond) continue;
    shown = link->Now();
    ShowDrives(&chain, rotors, chain.frames() - frames, static_cast<double>(now) * 1e-9);
    frames = chain.frames();
  }
  return kExitOk;
}

int Scan(const DrivesOptions& options) {
  const auto link =
      ethercat::OpenLink(ParseLink(options.link), ethercat::SocketLink::Side::kMaster);
  const std::string text = ConfigurationOf(ScanChain(link.get()));
  if (options.out.empty()) {
    fmt::print("{}", text);
  } else {
    WriteFile(options.out, text);
    fmt::print("{}: written\n", options.out);
  }
  return kExitOk;
}

}  // namespace

void AddDrivesCommand(CLI::App* app, Command* command) {
  CLI::App* const drives = AddGroup(app, "drives", "EtherCAT drives without a robot");
  const std::string link_help = "udp, udp:PORT, udp:ADDRESS:PORT, or raw:INTERFACE (CAP_NET_RAW)";

  const auto [emulate, options] = AddCommand<DrivesOptions>(
      drives, command, "emulate",
      "an emulated chain of drives, a rotor on each, for any master to try", Emulate);
  emulate->add_option("--link", options->link, link_help)->capture_default_str();
  emulate->add_option("--count", options->count, "drives")
      ->capture_default_str()
      ->check(Within("in [1, 200]", [](double n) { return n >= 1 && n <= 200; }));
  emulate->add_option("--profile", options->profile, "type, of deploy/drives")
      ->capture_default_str();
  emulate->add_option("--inertia", options->inertia, "kg·m², of each rotor")
      ->capture_default_str()
      ->check(Within("in (0, 1000]", [](double value) { return value > 0 && value <= 1000; }));
  emulate->add_option("--damping", options->damping, "N·m·s/rad, of each rotor")
      ->capture_default_str()
      ->check(Within("in (0, 1000000]", [](double value) { return value > 0 && value <= 1e6; }));
  emulate->add_option("--duration", options->duration, "s until they end; 0: until Ctrl-C")
      ->capture_default_str()
      ->check(Within("in [0, 1000000]", [](double s) { return s >= 0 && s <= 1e6; }));
  SetExample(emulate, "poise drives emulate --count 6 --duration 60");

  const auto [scan, scan_options] = AddCommand<DrivesOptions>(
      drives, command, "scan",
      "read a chain and write it as a configuration; slaves go to PRE-OP and back, no torque",
      Scan);
  scan->add_option("--link", scan_options->link, link_help)->capture_default_str();
  scan->add_option("--out", scan_options->out, "file; default: standard output");
  SetExample(scan, "poise drives scan --out chain.pbtxt");
}

}  // namespace poise
