#include "logging/derived/footprint.h"

#include "components/messages/conversions.h"
#include "logging/derived/definitions.h"

namespace poise::logging {
namespace {

constexpr double kFirm = 0.25;    // of the weight
constexpr double kBounce = 0.1;   // s without a load that leave a footprint what it is
constexpr double kSlid = 0.02;    // m, from above, that make it another one
constexpr double kRolled = 0.01;  // m that its centre is higher than at first: it rolls off

}  // namespace

void Footprint::Update(double time, bool in_contact, double load, const pose_t& sole,
                       double weight) {
  const bool firm = load > kFirm * weight;
  if (!firm && !(in_contact && load > kLoadedShare * weight)) {
    stands_ = stands_ && time - loaded_ <= kBounce;
    return;
  }
  loaded_ = time;
  if (stands_ && firm_ && !firm) return;
  const Eigen::Vector3d place = GetVector3(sole.position);
  if (stands_ && firm_ && (place - first_).head<2>().norm() > kSlid) stands_ = false;
  if (!stands_) {
    stands_ = true;
    firm_ = false;
    last_ = {time, sole};
  }
  if (firm_ && place.z() > first_.z() + kRolled) return;
  if (firm && !firm_) first_ = place;
  firm_ = firm;
  last_->sole = sole;
}

}  // namespace poise::logging
