// Names the class of each frame of a sequence: a mixture of Gaussians for each class, and a hidden Markov model that
// knows how long classes last and which follows which.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace osteon::test {

// A sequence to learn from.
struct LabelledFrames {
  Eigen::MatrixXd rows;      // a frame in each
  std::vector<int> classes;  // of each frame, from 0
  int condition = 0;         // such as the noise: each has a Gaussian of its own in each class
};

class GaussianHmm {
 public:
  // `share`: part of each covariance that all classes have in common, so that a class with few frames has one that can
  // be inverted. `weight`: of a frame's likelihood; frames that overlap are no independent witnesses.
  struct Params {
    double share = 0.3, weight = 0.3;
  };

  // Every class needs a frame.
  static GaussianHmm learned(const std::vector<LabelledFrames>& sequences, int classes, const Params& params);

  // The most probable sequence of classes, by the algorithm of Viterbi.
  [[nodiscard]] std::vector<int> named(const Eigen::MatrixXd& rows) const;

 private:
  struct Component {
    int of_class = 0;
    Eigen::RowVectorXd mean;
    Eigen::MatrixXd whitening;  // (x - mean) * whitening has the covariance I
    double log_scale = 0;       // log of weight over the root of the determinant
  };
  [[nodiscard]] Eigen::MatrixXd log_likelihoods(const Eigen::MatrixXd& rows) const;

  Params params_;
  int classes_ = 0;
  std::vector<Component> components_;
  Eigen::MatrixXd log_step_;      // from a class (row) to the next
  Eigen::RowVectorXd log_begin_;  // of a sequence
};

}  // namespace osteon::test
