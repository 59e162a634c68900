#include "hw_bridge/unitree/dds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <mutex>
#include <string>

#include "components/framework/clock.h"

namespace poise::unitree {
namespace {

/// A name that goes into CycloneDDS's configuration, which is XML.
void CheckName(const std::string& name, const char* what) {
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == ':' || c == '@';
  });
  if (!plain || name.size() > 100) {
    throw UnitreeError("{} \"{}\": letters, digits and _-.:@ only", what, name);
  }
}

std::string Configuration(const DdsLink& link) {
  CheckName(link.interface(), "interface");
  CheckName(link.tag(), "tag");
  if (link.interface().empty()) throw UnitreeError("interface: must not be empty");
  // Loopback does not call itself capable of multicast, but is.
  const bool loopback = link.interface() == "lo";
  std::string tag;
  if (link.has_tag()) tag = fmt::format("<Discovery><Tag>{}</Tag></Discovery>", link.tag());
  return fmt::format(
      "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"{}\" "
      "multicast=\"{}\"/></Interfaces></General>{}</Domain></CycloneDDS>",
      link.interface(), loopback ? "true" : "default", tag);
}

}  // namespace

/// A domain of this process, gone with its last participant.
class Participant::Domain {
 public:
  static std::shared_ptr<Domain> Get(const DdsLink& link) {
    const uint32_t id = link.domain();
    const std::string configuration = Configuration(link);
    static std::mutex mutex;
    static std::map<uint32_t, std::weak_ptr<Domain>> domains;
    const std::lock_guard lock(mutex);
    if (std::shared_ptr<Domain> known = domains[id].lock()) {
      if (known->configuration_ != configuration) {
        throw UnitreeError("DDS domain {} is in use on another interface or tag by this process",
                           id);
      }
      return known;
    }
    auto made = std::make_shared<Domain>(link, configuration);
    domains[id] = made;
    return made;
  }

  Domain(const DdsLink& link, const std::string& configuration) : configuration_(configuration) {
    entity_ = dds_create_domain(link.domain(), configuration.c_str());
    if (entity_ < 0) {
      throw UnitreeError(
          "DDS domain {} on interface {} cannot be entered ({}); does `ip link` list it, and is it "
          "up?",
          link.domain(), link.interface(), dds_strretcode(entity_));
    }
  }
  ~Domain() { dds_delete(entity_); }

 private:
  std::string configuration_;
  dds_entity_t entity_ = 0;
};

Participant::Participant(const DdsLink& link) : domain_(Domain::Get(link)) {
  entity_ = dds_create_participant(link.domain(), nullptr, nullptr);
  if (entity_ < 0) {
    throw UnitreeError("DDS domain {} on interface {} cannot be entered ({})", link.domain(),
                       link.interface(), dds_strretcode(entity_));
  }
}

Participant::~Participant() { dds_delete(entity_); }

Endpoint::Endpoint(const Participant& participant, Kind kind, const dds_topic_descriptor_t& type,
                   const char* topic, int32_t depth) {
  const auto check = [&](dds_entity_t entity) {
    if (entity >= 0) return entity;
    const std::string problem =
        fmt::format("DDS topic {} cannot be opened ({})", topic, dds_strretcode(entity));
    if (topic_ > 0) dds_delete(topic_);
    throw UnitreeError(problem);
  };
  topic_ = check(dds_create_topic(participant.entity(), &type, topic, nullptr, nullptr));
  dds_qos_t* qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  if (kind == Kind::kWriter) {
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(1));
    entity_ = dds_create_writer(participant.entity(), topic_, qos, nullptr);
  } else {
    dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);  // meets writers of either kind
    entity_ = dds_create_reader(participant.entity(), topic_, qos, nullptr);
  }
  dds_delete_qos(qos);
  check(entity_);
  if (kind == Kind::kWriter) return;
  dds_set_status_mask(entity_, DDS_DATA_AVAILABLE_STATUS);
  waitset_ = check(dds_create_waitset(participant.entity()));
  const dds_entity_t condition = check(dds_create_readcondition(entity_, DDS_ANY_STATE));
  check(dds_waitset_attach(waitset_, condition, 0));
}

Endpoint::~Endpoint() {
  if (waitset_ > 0) dds_delete(waitset_);
  dds_delete(entity_);
  dds_delete(topic_);
}

bool Endpoint::TakeSample(void* sample, int64_t* sent) {
  void* samples[1] = {sample};
  dds_sample_info_t info[1];
  // A sample that only tells of a writer's end is none.
  while (dds_take(entity_, samples, info, 1, 1) > 0) {
    if (!info[0].valid_data) continue;
    if (sent != nullptr) *sent = info[0].source_timestamp;
    return true;
  }
  return false;
}

bool Endpoint::AwaitSample(int64_t deadline) {
  dds_attach_t ignored[1];
  const int64_t left = std::max<int64_t>(0, deadline - NowNanoseconds());
  return dds_waitset_wait(waitset_, ignored, 1, left) > 0;
}

}  // namespace poise::unitree
