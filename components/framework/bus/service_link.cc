#include "components/framework/bus/service_link.h"

#include "components/framework/run.h"

namespace poise {

ServiceLink::ServiceLink(const RunSpec& spec, const std::string& component)
    : run_id_(spec.run_id()),
      sender_(ServiceUrl(spec)),
      receiver_(ServiceUrl(spec)),
      filter_(spec, {component}),
      health_channel_(HealthChannel(component)),
      control_bytes_(static_cast<size_t>(control_.getEncodedSize())) {
  health_.component = component;
  SetDetail("");
}

bool ServiceLink::SendControl(int8_t command, int64_t tick, int32_t channel) {
  control_.run_id = run_id_;
  control_.tick = tick;
  control_.command = command;
  control_.channel = channel;
  const int size =
      control_.encode(control_bytes_.data(), 0, static_cast<int>(control_bytes_.size()));
  return size > 0 &&
         sender_.Send(kControlChannel, control_bytes_.data(), static_cast<size_t>(size));
}

void ServiceLink::SetDetail(std::string_view detail) {
  health_.detail = detail;
  health_bytes_.resize(static_cast<size_t>(health_.getEncodedSize()));
}

bool ServiceLink::SendHealth() {
  health_.run_id = run_id_;
  const int size = health_.encode(health_bytes_.data(), 0, static_cast<int>(health_bytes_.size()));
  return size > 0 &&
         sender_.Send(health_channel_.c_str(), health_bytes_.data(), static_cast<size_t>(size));
}

}  // namespace poise
