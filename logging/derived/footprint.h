// Where a foot stands, or stood last.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "poise/pose_t.hpp"

namespace poise::logging {

/// Follows one foot. It stands while it carries something: 5 % of the weight where the plan has it
/// in contact, else a quarter. The print is its sole's in the last of these ticks in which it
/// carried a quarter and lay flat (in none: carried anything): before that it may bounce,
/// afterwards roll off. A foot that slides leaves several.
class Footprint {
 public:
  struct Print {
    double since = 0;  ///< s
    pose_t sole;
  };

  /// `time` in s, ascending; `load` in N, of the ground on the foot; `weight` in N.
  void Update(double time, bool in_contact, double load, const pose_t& sole, double weight);
  /// Empty before the foot has stood.
  const std::optional<Print>& last() const { return last_; }

 private:
  std::optional<Print> last_;
  bool stands_ = false;
  bool firm_ = false;  // it has carried a quarter since it stands there
  double loaded_ = 0;  // s, when it carried last
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();  // where it was when it first stood firmly
};

}  // namespace poise::logging
