#include "compensation/fit/least_squares.h"

#include <Eigen/SVD>
#include <limits>

namespace trn {

LeastSquares::LeastSquares(const Eigen::MatrixXd& A) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  U_ = svd.matrixU();
  V_ = svd.matrixV();
  values_ = svd.singularValues();
}

Eigen::Index LeastSquares::rank() const {
  if (values_.size() == 0) return 0;
  const double noise =
      values_[0] * std::numeric_limits<double>::epsilon() * static_cast<double>(values_.size());
  return (values_.array() > noise).count();
}

Eigen::VectorXd LeastSquares::solve(const Eigen::VectorXd& b) const {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(V_.rows());
  const Eigen::Index told = rank();
  for (Eigen::Index k = 0; k < told; ++k) x += (U_.col(k).dot(b) / values_[k]) * V_.col(k);
  return x;
}

Eigen::MatrixXd LeastSquares::covariance() const {
  Eigen::MatrixXd scaled = V_;
  for (Eigen::Index k = 0; k < values_.size(); ++k) scaled.col(k) /= values_[k];
  return scaled.lazyProduct(scaled.transpose());
}

double LeastSquares::condition() const { return values_[0] / values_[values_.size() - 1]; }

}  // namespace trn
