#include "hw_bridge/ethercat/ethercat_bus_type.h"

#include <fmt/format.h>

#include <cmath>

#include "components/framework/configuration/config_error.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"
#include "hw_bridge/ethercat/links/pcap.h"

namespace poise::ethercat {
namespace {

/// The configured link, with its capture. No frame passes before it is open.
class BusLink final : public Link {
 public:
  void Open(const LinkOpener& open_link, const EthercatBusConfig& config) {
    link_ = open_link(config.link());
    if (config.has_capture()) {
      using Carrier = PcapWriter::Carrier;
      writer_ = std::make_unique<PcapWriter>(
          config.capture(), config.link().has_udp() ? Carrier::kUdp : Carrier::kEthernet);
      capture_ = std::make_unique<CaptureLink>(link_.get(), writer_.get());
    }
    open_ = capture_ ? capture_.get() : link_.get();
  }
  bool open() const { return open_ != nullptr; }
  /// Empty: done; else what could not be written.
  std::string CloseCapture() {
    if (!writer_) return {};
    try {
      writer_->Close();
    } catch (const EthercatError& error) {
      return error.what();
    }
    return {};
  }

  int64_t Now() const override { return open() ? open_->Now() : 0; }
  bool Send(std::span<const uint8_t> frame) override { return open() && open_->Send(frame); }
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
    return open() ? open_->Receive(frame, deadline) : 0;
  }

 private:
  std::unique_ptr<Link> link_;
  std::unique_ptr<PcapWriter> writer_;
  std::unique_ptr<CaptureLink> capture_;
  Link* open_ = nullptr;  // of both
};

/// A base, so that it is there before the bus.
struct HasLink {
  BusLink link;
};

class LinkedDriveBus final : private HasLink, public EthercatDriveBus {
 public:
  LinkedDriveBus(LinkOpener open_link, const EthercatBusConfig& config,
                 const robot::RobotModel& model)
      : EthercatDriveBus(&link, config, model), open_link_(std::move(open_link)), config_(config) {}

  void Start() override {
    link.Open(open_link_, config_);
    EthercatDriveBus::Start();
  }
  std::string Stop() override {
    if (!link.open()) return {};
    std::string problem = EthercatDriveBus::Stop();
    const std::string capture = link.CloseCapture();
    if (!capture.empty()) problem += (problem.empty() ? "" : "; ") + capture;
    return problem;
  }

 private:
  LinkOpener open_link_;
  EthercatBusConfig config_;
};

}  // namespace

DriveBusType EthercatBusType(LinkOpener open_link) {
  const auto make = [open_link = std::move(open_link)](
                        EthercatBusConfig config, const robot::RobotModel& model, double period) {
    const auto cycle = static_cast<uint32_t>(std::llround(period * 1e9));
    if (config.master().has_cycle() && config.master().cycle() != cycle) {
      throw ConfigError("master.cycle",
                        fmt::format("must be the run's period, {} ns, or be left out", cycle));
    }
    config.mutable_master()->set_cycle(cycle);
    return std::make_unique<LinkedDriveBus>(open_link, config, model);
  };
  return {.name = "ethercat",
          .config = EthercatBusConfig::descriptor(),
          .make = MakerOf<EthercatBusConfig>(make),
          .link = {.link = "link",
                   .simulated_time = "simulated_time",
                   .profile = "master.profile",
                   .capture = "capture"}};
}

}  // namespace poise::ethercat
