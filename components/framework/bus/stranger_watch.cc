#include "components/framework/bus/stranger_watch.h"

#include <algorithm>
#include <functional>
#include <span>

#include "components/framework/run.h"
#include "fmt/format.h"
#include "poise/emergency_stop_t.hpp"

namespace poise {
namespace {

constexpr int kMostAtOnce = 256;  // packets of a port: a flood must not keep the caller
constexpr size_t kMostNamed = 3;

}  // namespace

bool TakesStopsOfAll(const Channel& channel) {
  return channel.external() && channel.type() == "emergency_stop_t";
}

bool OnlyStops(const BusReceiver::Packet& packet) {
  emergency_stop_t message{};
  const auto size = static_cast<int>(packet.size);
  return message.getEncodedSize() == size && message.decode(packet.data, 0, size) == size &&
         message.stop != 0 && message.reset == 0;
}

StrangerWatch::StrangerWatch(const RunSpec& spec, Ports ports) {
  const auto add = [&](std::string channel, bool stops, const std::string& url) {
    ears_.push_back(
        {std::move(channel), stops, std::make_unique<BusReceiver>(url, OfOthers(spec))});
  };
  if (ports == Ports::kMirror) {
    add("MIRROR", false, MirrorUrl(spec));
    return;
  }
  add(kControlChannel, false, ServiceUrl(spec));
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    const Channel& channel = spec.graph().channel(i);
    add(channel.name(), TakesStopsOfAll(channel), ChannelUrl(spec, i));
  }
}

bool StrangerWatch::Look() {
  bool any = false;
  for (const Ear& ear : ears_) {
    std::span<const uint8_t> datagram;
    PacketSource source;
    for (int i = 0; i < kMostAtOnce && ear.receiver->ReceiveAny(&datagram, &source); ++i) {
      BusReceiver::Packet packet;
      if (ParseDatagram(datagram.data(), datagram.size(), &packet)) {
        // Every program that listens by liblcm sends itself the first of these.
        if (packet.channel == "LCM_SELF_TEST" || (ear.stops && OnlyStops(packet))) continue;
      }
      Count(ear.channel, source);
      any = true;
    }
  }
  return any;
}

void StrangerWatch::Count(const std::string& channel, const PacketSource& source) {
  auto known = std::ranges::find_if(strangers_, [&](const Stranger& stranger) {
    return stranger.channel == channel && stranger.source == source;
  });
  if (known == strangers_.end() && strangers_.size() < kMostStrangers) {
    strangers_.push_back({channel, source, 0});
    known = strangers_.end() - 1;
  } else if (known == strangers_.end()) {
    if (strangers_.size() == kMostStrangers) strangers_.push_back({"others", {}, 0});
    known = strangers_.end() - 1;
  }
  ++known->packets;
}

std::string Describe(std::vector<Stranger> strangers) {
  if (strangers.empty()) return "";
  std::ranges::stable_sort(strangers, std::greater<>(), &Stranger::packets);
  int64_t packets = 0;
  std::string named;
  for (size_t i = 0; i < strangers.size(); ++i) {
    packets += strangers[i].packets;
    if (i >= kMostNamed) continue;
    named += fmt::format("{}{} to {} from {}", i == 0 ? "" : ", ", strangers[i].packets,
                         strangers[i].channel, ToString(strangers[i].source));
  }
  if (strangers.size() > kMostNamed) named += ", ...";
  return fmt::format("{} packets from outside the run: {}", packets, named);
}

}  // namespace poise
