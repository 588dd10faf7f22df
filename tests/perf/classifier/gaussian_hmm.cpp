#include "tests/perf/classifier/gaussian_hmm.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/core/check.hpp"

namespace osteon::test {
namespace {

struct Sums {
  double count = 0;
  Eigen::RowVectorXd sum;
  Eigen::MatrixXd squares;
};

// Sums of each class and condition.
std::map<std::pair<int, int>, Sums> sums_of(const std::vector<LabelledFrames>& sequences) {
  std::map<std::pair<int, int>, Sums> all;
  for (const LabelledFrames& sequence : sequences) {
    OSTEON_CHECK(sequence.rows.rows() == std::ssize(sequence.classes));
    for (Eigen::Index i = 0; i < sequence.rows.rows(); ++i) {
      Sums& s = all[{sequence.classes[static_cast<std::size_t>(i)], sequence.condition}];
      const auto row = sequence.rows.row(i);
      if (s.count == 0) {
        s.sum = Eigen::RowVectorXd::Zero(row.size());
        s.squares = Eigen::MatrixXd::Zero(row.size(), row.size());
      }
      s.count += 1;
      s.sum += row;
      s.squares.noalias() += row.transpose() * row;
    }
  }
  return all;
}

}  // namespace

GaussianHmm GaussianHmm::learned(const std::vector<LabelledFrames>& sequences, int classes, const Params& params) {
  GaussianHmm model;
  model.params_ = params;
  model.classes_ = classes;
  const auto all = sums_of(sequences);
  const Eigen::Index size = sequences.front().rows.cols();
  const auto spread = [](const Sums& s) -> Eigen::MatrixXd {
    return s.squares / s.count - (s.sum.transpose() * s.sum) / (s.count * s.count);
  };
  Eigen::MatrixXd common = Eigen::MatrixXd::Zero(size, size);
  double frames = 0;
  std::vector<double> of_class(static_cast<std::size_t>(classes), 0.0);
  for (const auto& [key, s] : all) {
    common += s.count * spread(s);
    frames += s.count;
    of_class[static_cast<std::size_t>(key.first)] += s.count;
  }
  common /= frames;
  common.diagonal().array() += 1e-6;
  OSTEON_CHECK(std::ranges::all_of(of_class, [](double count) { return count > 0; }));

  for (const auto& [key, s] : all) {
    const Eigen::MatrixXd covariance = (1.0 - params.share) * spread(s) + params.share * common;
    const Eigen::LLT<Eigen::MatrixXd> root(covariance);
    OSTEON_CHECK(root.info() == Eigen::Success);
    Component component{.of_class = key.first, .mean = s.sum / s.count, .whitening = {}, .log_scale = 0};
    const Eigen::MatrixXd lower = root.matrixL();
    component.whitening = lower.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(size, size)).transpose();
    component.log_scale =
        std::log(s.count / of_class[static_cast<std::size_t>(key.first)]) - lower.diagonal().array().log().sum();
    model.components_.push_back(std::move(component));
  }

  // One more of each than was counted: what never happened is unlikely, and not impossible.
  Eigen::MatrixXd steps = Eigen::MatrixXd::Ones(classes, classes);
  Eigen::RowVectorXd begins = Eigen::RowVectorXd::Ones(classes);
  for (const LabelledFrames& sequence : sequences) {
    begins(sequence.classes.front()) += 1;
    for (std::size_t i = 1; i < sequence.classes.size(); ++i) steps(sequence.classes[i - 1], sequence.classes[i]) += 1;
  }
  model.log_step_ = steps.array().colwise() / steps.rowwise().sum().array();
  model.log_step_ = model.log_step_.array().log();
  model.log_begin_ = (begins / begins.sum()).array().log();
  return model;
}

Eigen::MatrixXd GaussianHmm::log_likelihoods(const Eigen::MatrixXd& rows) const {
  constexpr double kNever = -1e300;
  Eigen::MatrixXd likelihoods = Eigen::MatrixXd::Constant(rows.rows(), classes_, kNever);
  for (const Component& component : components_) {
    const Eigen::MatrixXd white = (rows.rowwise() - component.mean) * component.whitening;
    const Eigen::VectorXd one = (component.log_scale - 0.5 * white.rowwise().squaredNorm().array()).matrix();
    // The best component stands for all of its class.
    likelihoods.col(component.of_class) = likelihoods.col(component.of_class).cwiseMax(one);
  }
  return likelihoods;
}

std::vector<int> GaussianHmm::named(const Eigen::MatrixXd& rows) const {
  const Eigen::MatrixXd likelihoods = params_.weight * log_likelihoods(rows);
  Eigen::MatrixXi from = Eigen::MatrixXi::Zero(rows.rows(), classes_);
  Eigen::RowVectorXd best = log_begin_ + likelihoods.row(0);
  for (Eigen::Index t = 1; t < rows.rows(); ++t) {
    Eigen::RowVectorXd next(classes_);
    for (int c = 0; c < classes_; ++c) {
      Eigen::Index before = 0;
      next(c) = (best.transpose() + log_step_.col(c)).maxCoeff(&before) + likelihoods(t, c);
      from(t, c) = static_cast<int>(before);
    }
    best = next;
  }
  std::vector<int> names(static_cast<std::size_t>(rows.rows()));
  Eigen::Index last = 0;
  best.maxCoeff(&last);
  for (Eigen::Index t = rows.rows() - 1; t >= 0; --t) {
    names[static_cast<std::size_t>(t)] = static_cast<int>(last);
    last = from(t, last);
  }
  return names;
}

}  // namespace osteon::test
