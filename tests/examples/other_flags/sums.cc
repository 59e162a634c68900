// Compiled three times: what Eigen makes of it depends on the flags.
#include <Eigen/Dense>

double SUMS(const double* values, int size) {
  const Eigen::Map<const Eigen::VectorXd> v(values, size);
  const Eigen::MatrixXd matrix = v * v.transpose() + Eigen::MatrixXd::Identity(size, size);
  return (matrix * v).sum() + v.dot(matrix.ldlt().solve(v));
}
