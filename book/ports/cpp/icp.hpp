// The robust ICP loop (section 4 of the lesson).

#pragma once

#include <optional>
#include <string_view>

#include "correspondences.hpp"
#include "parameters.hpp"
#include "se2.hpp"

namespace icp2d {

enum class Termination {
    converged_pose,           // the last step was below both pose tolerances
    converged_cost,           // the cost stopped changing
    budget_spent,             // not converged
    too_few_correspondences,  // failed: fewer than 3 pairs are left
    degenerate,               // failed: the pairs leave the motion undetermined
};

std::string_view to_string(Termination termination);

struct Result {
    std::optional<Eigen::Isometry2d> T_target_source;  // none where the run failed
    Termination termination;
    Eigen::Index iterations;          // steps taken
    Correspondences correspondences;  // the last association
};

/// Estimates the transform that maps the newer scan (source) onto the older one (target).
///
/// What the data do is a termination. Throws std::invalid_argument for a scan without points
/// and for parameters out of range.
Result icp(const Points& source, const Points& target, const Eigen::Isometry2d& T_initial,
           const Parameters& parameters = {});

}  // namespace icp2d
