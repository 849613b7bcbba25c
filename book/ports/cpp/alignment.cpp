#include "alignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace icp2d {
namespace {

constexpr double relative_resolution = 1e-10;  // far above rounding, far below a real scan
constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// The pairs that have a weight: the others say nothing, wherever they lie.
Pairs with_weight(const Pairs& pairs) {
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < pairs.w.size(); ++i) {
        if (pairs.w(i) > 0.0) kept.push_back(i);
    }
    return {pairs.p(Eigen::all, kept), pairs.q(Eigen::all, kept), pairs.w(kept)};
}

/// Weighted root mean square distance from the centroid, in metres.
double spread(const Points& centered, const Eigen::VectorXd& w) {
    return std::sqrt(centered.colwise().squaredNorm().dot(w) / w.sum());
}

double largest_coordinate(const Points& points) {
    return points.cwiseAbs().maxCoeff();
}

/// The spread below which points cannot be told from a single one.
double resolution(const Points& points, const Points& centered) {
    return std::max(64.0 * epsilon * largest_coordinate(points),
                    relative_resolution * largest_coordinate(centered));
}

}  // namespace

// The numbers are those of "Alignment" in the specification. A test reads "not above" instead
// of "below or equal", so that coordinates whose squares overflow count as degenerate too.
std::optional<Eigen::Isometry2d> align(const Pairs& pairs) {
    const auto [p, q, w] = with_weight(pairs);  // 1
    if (w.size() == 0) return std::nullopt;

    const double W = w.sum();
    const Eigen::Vector2d p_mean = p * w / W;  // 2
    const Eigen::Vector2d q_mean = q * w / W;
    const Points x = p.colwise() - p_mean;
    const Points y = q.colwise() - q_mean;

    const double s_x = spread(x, w);  // 3
    const double s_y = spread(y, w);
    if (!(s_x > resolution(p, x) && s_y > resolution(q, y))) return std::nullopt;

    const Eigen::Matrix2d H = x * w.asDiagonal() * y.transpose();  // 4: Σ w x yᵀ
    const double a = H(0, 0) + H(1, 1);                            // Σ w (x · y)
    const double b = H(0, 1) - H(1, 0);                            // Σ w (x × y)
    if (!(std::hypot(a, b) > relative_resolution * W * s_x * s_y)) return std::nullopt;

    const Eigen::Rotation2Dd R(std::atan2(b, a));  // 5
    return Eigen::Translation2d(q_mean - R * p_mean) * R;
}

}  // namespace icp2d
