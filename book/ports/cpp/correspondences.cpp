#include "correspondences.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace icp2d {
namespace {

Points nearest(const NearestNeighbors& target, const Points& queries) {
    Points found(2, queries.cols());
    for (Eigen::Index i = 0; i < queries.cols(); ++i) found.col(i) = target.find(queries.col(i));
    return found;
}

/// Σ ρ(min(d, gate)): a pair outside the gate is charged as if it stood on it.
double truncated_loss(const Indices& pairs, const Eigen::VectorXd& distances,
                      const Parameters& parameters) {
    double sum = 0.0;
    for (const Eigen::Index i : pairs) {
        const double charged = std::min(distances(i), parameters.max_correspondence_distance);
        sum += huber_loss(charged, parameters.huber_delta);
    }
    return sum;
}

}  // namespace

Indices overlap(const Eigen::VectorXd& distances, double ratio) {
    Indices order(static_cast<std::size_t>(distances.size()));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::stable_sort(order.begin(), order.end(), [&](Eigen::Index i, Eigen::Index j) {
        return distances(i) < distances(j);  // stable: of equal ones the first
    });
    const auto share = static_cast<Eigen::Index>(ratio * static_cast<double>(distances.size()));
    const auto count = std::min(distances.size(), std::max(min_pairs, share));
    order.resize(static_cast<std::size_t>(count));
    return order;
}

Indices gate(Indices pairs, const Eigen::VectorXd& distances, double max_distance) {
    const auto outside = [&](Eigen::Index i) { return !(distances(i) <= max_distance); };
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(), outside), pairs.end());
    return pairs;
}

double huber_weight(double distance, double delta) {
    return distance <= delta ? 1.0 : delta / distance;
}

double huber_loss(double distance, double delta) {
    const double capped = std::min(distance, delta);
    return capped * (2.0 * distance - capped);
}

// The numbers are those of "Association" in the specification.
Correspondences associate(const Points& source, const NearestNeighbors& target,
                          const Eigen::Isometry2d& T_target_source, const Parameters& parameters) {
    const Points moved = T_target_source * source;  // 1
    const Points matched = nearest(target, moved);  // 2
    const Eigen::VectorXd distances = (moved - matched).colwise().norm();

    // 4, then 3: the overlap looks at all distances, gated or not.
    const Indices closest = overlap(distances, parameters.overlap_ratio);
    const Indices kept = gate(closest, distances, parameters.max_correspondence_distance);

    const Eigen::VectorXd d = distances(kept);  // 5
    const Eigen::VectorXd weights =
        d.unaryExpr([&](double r) { return huber_weight(r, parameters.huber_delta); });

    const auto N = static_cast<double>(source.cols());
    const double cost = truncated_loss(closest, distances, parameters) / N;  // 6

    const auto n = static_cast<double>(kept.size());  // 7
    const double fitness = n / N;
    std::optional<double> inlier_rmse;
    if (n > 0) inlier_rmse = std::sqrt(d.squaredNorm() / n);

    return {{moved(Eigen::all, kept), matched(Eigen::all, kept), weights},
            fitness, inlier_rmse, cost};
}

}  // namespace icp2d
