#include "icp.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace icp2d {
namespace {

void require_points(const Points& points, const std::string& name) {
    if (points.cols() == 0) throw std::invalid_argument("the " + name + " has no points");
    if (!points.allFinite()) throw std::invalid_argument("the " + name + " must be finite");
}

/// Where the loop stands: a pose, and the association made there.
struct State {
    Eigen::Isometry2d T_target_source;
    Correspondences pairs;
};

/// The step dT that best moves the kept pairs together.
std::optional<Eigen::Isometry2d> minimise(const Correspondences& pairs) {
    return align(pairs.kept);
}

/// Why no step can come from `pairs`; nothing where one can.
std::optional<Termination> check_pairs(const Correspondences& pairs) {
    if (pairs.inlier_count() < min_pairs) return Termination::too_few_correspondences;
    return std::nullopt;
}

/// Whether to stop, and why. The two pose tests hold together: a scan that turns about its
/// own centre does not move, and under "either of them" it would stop at the first step.
/// They come before the count of pairs: the pose was estimated from enough of them.
std::optional<Termination> check_convergence(const State& before, const State& now,
                                             Eigen::Index iterations,
                                             const Parameters& parameters) {
    const Eigen::Isometry2d T_before_now = before.T_target_source.inverse() * now.T_target_source;
    if (T_before_now.translation().norm() < parameters.translation_tolerance &&
        std::abs(heading(T_before_now)) < parameters.rotation_tolerance) {
        return Termination::converged_pose;
    }
    if (const auto no_step = check_pairs(now.pairs)) return no_step;
    if (parameters.cost_tolerance > 0.0 &&
        std::abs(now.pairs.cost - before.pairs.cost) < parameters.cost_tolerance) {
        return Termination::converged_cost;
    }
    if (iterations >= parameters.max_iterations) return Termination::budget_spent;
    return std::nullopt;
}

}  // namespace

// The numbers are those of "The loop" in the specification.
Result icp(const Points& source, const Points& target, const Eigen::Isometry2d& T_initial,
           const Parameters& parameters) {
    require_valid(parameters);
    require_points(source, "source");
    require_points(target, "target");
    const NearestNeighbors search(target);
    const auto associate_at = [&](const Eigen::Isometry2d& T_target_source) {
        return State{T_target_source, associate(source, search, T_target_source, parameters)};
    };

    State now = associate_at(T_initial);  // 1
    auto termination = check_pairs(now.pairs);
    Eigen::Index iterations = 0;
    while (!termination) {
        const auto dT = minimise(now.pairs);  // 2
        if (!dT) {
            termination = Termination::degenerate;
            break;
        }
        const Eigen::Isometry2d T = *dT * now.T_target_source;  // 3: composed on the left
        ++iterations;
        const State before = std::exchange(now, associate_at(T));              // 4
        termination = check_convergence(before, now, iterations, parameters);  // 5
    }

    const bool failed = termination == Termination::too_few_correspondences ||
                        termination == Termination::degenerate;
    return {failed ? std::nullopt : std::optional(now.T_target_source), *termination, iterations,
            std::move(now.pairs)};
}

std::string_view to_string(Termination termination) {
    switch (termination) {
        case Termination::converged_pose: return "converged_pose";
        case Termination::converged_cost: return "converged_cost";
        case Termination::budget_spent: return "budget_spent";
        case Termination::too_few_correspondences: return "too_few_correspondences";
        case Termination::degenerate: return "degenerate";
    }
    throw std::logic_error("a termination without a name");
}

}  // namespace icp2d
