// Compiled three times: what Eigen makes of it depends on the flags. Poise has these functions of Eigen's, too.
#include <Eigen/Eigenvalues>

double SUMS(const double* values, int size) {
  const Eigen::Map<const Eigen::VectorXd> v(values, size);
  Eigen::MatrixXd matrix = v * v.transpose();
  matrix.diagonal(1).array() += 1;  // not symmetric
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(matrix);
  return solver.eigenvalues().cwiseAbs().sum() + solver.pseudoEigenvectors().cwiseAbs().sum();
}
