#include "tools/ros2/ros2_writers.h"

#include "fmt/format.h"

namespace poise {
namespace {

constexpr int32_t kDefaultDepth = 10;    // of ROS 2's default quality of service
constexpr int32_t kRosoutDepth = 1'000;  // of its rosout
// A reliable reader that acknowledges nothing may hold a write for so long; then the sample counts
// as written for the others and is lost to it.
constexpr dds_duration_t kMostBlocking = DDS_MSECS(1);

}  // namespace

Ros2Writer::Ros2Writer(const unitree::Participant& participant, const dds_topic_descriptor_t& type,
                       const std::string& name, Keeping keeping) {
  const std::string dds_name = "rt/" + name;
  const auto check = [&](dds_entity_t entity) {
    if (entity >= 0) return entity;
    if (topic_ > 0) dds_delete(topic_);
    throw unitree::UnitreeError(
        fmt::format("DDS topic {} cannot be opened ({})", dds_name, dds_strretcode(entity)));
  };
  topic_ = check(dds_create_topic(participant.entity(), &type, dds_name.c_str(), nullptr, nullptr));
  dds_qos_t* const qos = dds_create_qos();
  const int32_t depth = keeping == Keeping::kNone   ? kDefaultDepth
                        : keeping == Keeping::kLast ? 1
                                                    : kRosoutDepth;
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, kMostBlocking);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  if (keeping != Keeping::kNone) {
    dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
    dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  writer_ = dds_create_writer(participant.entity(), topic_, qos, nullptr);
  dds_delete_qos(qos);
  check(writer_);
}

Ros2Writer::~Ros2Writer() {
  dds_delete(writer_);
  dds_delete(topic_);
}

bool Ros2Writer::Write(const void* message) {
  return dds_write(writer_, message) == DDS_RETCODE_OK;
}

}  // namespace poise
