#include "components/framework/bus/service_link.h"

#include "components/framework/run.h"

namespace poise {

ServiceLink::ServiceLink(const RunSpec& spec, const RunSocket& socket,
                         const std::vector<std::string>& components)
    : run_id_(spec.run_id()),
      sender_(socket, ServiceUrl(spec)),
      receiver_(ServiceUrl(spec), OfRun(spec)),
      filter_(spec, components),
      control_bytes_(static_cast<size_t>(control_.getEncodedSize())) {
  for (const std::string& component : components) {
    reports_.push_back({HealthChannel(component), {}, {}});
    reports_.back().health.component = component;
    SetDetail("", reports_.size() - 1);
  }
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

void ServiceLink::SetDetail(std::string_view detail, size_t component) {
  Report& report = reports_[component];
  report.health.detail = detail;
  report.bytes.resize(static_cast<size_t>(report.health.getEncodedSize()));
}

bool ServiceLink::SendHealth(size_t component) {
  Report& report = reports_[component];
  report.health.run_id = run_id_;
  const int size =
      report.health.encode(report.bytes.data(), 0, static_cast<int>(report.bytes.size()));
  return size > 0 && sender_.Send(report.channel, report.bytes.data(), static_cast<size_t>(size));
}

}  // namespace poise
