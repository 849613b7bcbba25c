// Alignment for fixed correspondences, in closed form (section 3 of the lesson).

#pragma once

#include <optional>

#include "se2.hpp"

namespace icp2d {

/// Matched points: column i of p belongs to column i of q, with weight w(i) ≥ 0.
struct Pairs {
    Points p;           // of the source
    Points q;           // of the target
    Eigen::VectorXd w;  // only their ratios matter
};

/// The T_target_source that minimises Σ w ‖R p + t − q‖², or nothing where the pairs are
/// degenerate: where every rotation, or more than one, fits equally well.
std::optional<Eigen::Isometry2d> align(const Pairs& pairs);

}  // namespace icp2d
