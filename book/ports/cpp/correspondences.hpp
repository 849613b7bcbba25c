// Which target point belongs to which source point, and which pairs to believe (section 4).
//
// Distances, gate and delta are in metres, never squares.

#pragma once

#include <optional>
#include <vector>

#include "alignment.hpp"
#include "neighbors.hpp"
#include "parameters.hpp"

namespace icp2d {

using Indices = std::vector<Eigen::Index>;

inline constexpr Eigen::Index min_pairs = 3;  // the fewest that a step is computed from

/// What one association leaves.
struct Correspondences {
    Pairs kept;                         // moved source points, their targets, Huber's weights
    double fitness;                     // kept pairs / source points
    std::optional<double> inlier_rmse;  // of the kept pairs [m]; none where none is kept
    double cost;                        // J [m²], truncated Huber

    Eigen::Index inlier_count() const { return kept.w.size(); }
};

/// The pairs with the ⌊ratio · N⌋ smallest distances of all, at least 3: the trimming step.
Indices overlap(const Eigen::VectorXd& distances, double ratio);

/// Those of `pairs` that lie within the gate.
Indices gate(Indices pairs, const Eigen::VectorXd& distances, double max_distance);

/// Huber's weight: 1 up to δ, δ/d beyond.
double huber_weight(double distance, double delta);

/// Huber's loss [m²], which that weight comes from: d² up to δ, 2δd − δ² beyond.
double huber_loss(double distance, double delta);

/// Matches, rejects and weights at the pose T_target_source.
Correspondences associate(const Points& source, const NearestNeighbors& target,
                          const Eigen::Isometry2d& T_target_source, const Parameters& parameters);

}  // namespace icp2d
