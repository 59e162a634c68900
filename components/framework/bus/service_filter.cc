#include "components/framework/bus/service_filter.h"

#include "components/framework/run.h"
#include "poise/message_traits.hpp"

namespace poise {

ServiceFilter::ServiceFilter(const RunSpec& spec, const std::vector<std::string>& others)
    : run_id_(spec.run_id()),
      control_filter_(run_control_t::getHash(), run_control_t{}.getEncodedSize(), {}, run_id_) {
  const auto add = [&](const std::string& name) { name_of_channel_[HealthChannel(name)] = name; };
  add(kRecorderName);
  for (const std::string& name : others) add(name);
  for (const ComponentInstance& instance : spec.graph().component()) add(instance.name());
}

bool ServiceFilter::DecodeControl(const BusReceiver::Packet& packet, run_control_t* control) {
  return CountUnless(control_filter_.Check(packet.data, packet.size, INT64_MIN, INT64_MAX) ==
                             PacketVerdict::kAccepted &&
                         control->decode(packet.data, 0, static_cast<int>(packet.size)) ==
                             static_cast<int>(packet.size),
                     packet);
}

bool ServiceFilter::CheckHealth(const BusReceiver::Packet& packet) {
  return CountUnless(IsHealth(packet), packet);
}

bool ServiceFilter::DecodeHealth(const BusReceiver::Packet& packet, health_t* health) {
  return CountUnless(IsHealth(packet) &&
                         DecodeChecked(packet.data, static_cast<int64_t>(packet.size), health) &&
                         health->component == name_of_channel_.find(packet.channel)->second,
                     packet);
}

bool ServiceFilter::IsHealth(const BusReceiver::Packet& packet) const {
  using Traits = MessageTraits<health_t>;
  const auto size = static_cast<int64_t>(packet.size);
  return name_of_channel_.find(packet.channel) != name_of_channel_.end() &&
         Traits::WellFormedSize(packet.data, size) == size &&
         ReadInt64(packet.data) == health_t::getHash() &&
         ReadInt64(packet.data + Traits::kRunIdOffset) == run_id_;
}

bool ServiceFilter::CountUnless(bool good, const BusReceiver::Packet& packet) {
  // liblcm's own probe of a new sender.
  if (!good && packet.channel != "LCM_SELF_TEST") ++refused_;
  return good;
}

}  // namespace poise
