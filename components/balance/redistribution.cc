#include "components/balance/redistribution.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace poise::balance {

double RedistributionTorque(const MatrixRef& contact_jacobian, const VectorRef& wrench_change,
                            Eigen::Ref<Eigen::VectorXd> torque) {
  const Eigen::Index k = torque.size();
  if (contact_jacobian.rows() != 12 || contact_jacobian.cols() != k + 6 ||
      wrench_change.size() != 12) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Eigen::Matrix<double, 12, 1> change = wrench_change;
  for (Eigen::Index i = 0; i < k; ++i) {
    torque(i) = contact_jacobian.col(i + 6).head<12>().dot(change);
  }
  double squared = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double force = contact_jacobian.col(i).head<12>().dot(change);
    squared += force * force;
  }
  return std::sqrt(squared);
}

double ShareWithin(const VectorRef& limit, const VectorRef& torque, const VectorRef& change) {
  double share = 1;
  for (Eigen::Index i = 0; i < torque.size(); ++i) {
    const double room = limit[i] - (change[i] < 0 ? -torque[i] : torque[i]);
    if (room >= 0 && std::abs(change[i]) > room) {
      share = std::min(share, room / std::abs(change[i]));
    }
  }
  return share;
}

}  // namespace poise::balance
