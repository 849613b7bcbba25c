#include "simulation.hpp"

#include <algorithm>
#include <cmath>

namespace icp2d {
namespace {

constexpr Eigen::Index wall_points = 150;
constexpr Eigen::Index scattered_points = 300;
constexpr double width = 8.0;                     // m, the wall along x
constexpr double depth = 6.0;                     // m, the wall along y
constexpr double range_max = 10.0;                // m
constexpr double half_field_of_view = 0.75 * pi;  // rad, to either side
constexpr double noise_std = 0.01;                // m, on x and on y
constexpr double clutter = 2.0;                   // m, spurious returns lie within ± this

/// Points scattered evenly over a rectangle.
Points scatter(Eigen::Index count, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
               std::mt19937& rng) {
    std::uniform_real_distribution<double> fraction(0.0, 1.0);
    return Points::NullaryExpr(2, count, [&](Eigen::Index axis, Eigen::Index) {
        return low(axis) + fraction(rng) * (high(axis) - low(axis));
    });
}

bool in_reach(const Eigen::Vector2d& point) {
    return point.norm() <= range_max &&
           std::abs(std::atan2(point.y(), point.x())) <= half_field_of_view;
}

}  // namespace

Points simulate_world(std::mt19937& rng) {
    Points world(2, 2 * wall_points + scattered_points);
    world << scatter(wall_points, {0.0, 0.0}, {width, 0.0}, rng),
             scatter(wall_points, {0.0, 0.0}, {0.0, depth}, rng),
             scatter(scattered_points, {0.0, 0.0}, {width, depth}, rng);
    return world;
}

Points simulate_scan(const Points& world, const Eigen::Isometry2d& T_world_scanner,
                     std::mt19937& rng) {
    Points scan = T_world_scanner.inverse() * world;
    Eigen::Index seen = 0;
    for (Eigen::Index i = 0; i < scan.cols(); ++i) {
        if (in_reach(scan.col(i))) scan.col(seen++) = scan.col(i);
    }
    const Eigen::Index spurious = std::max<Eigen::Index>(5, seen / 40);
    scan.conservativeResize(Eigen::NoChange, seen + spurious);

    std::normal_distribution<double> noise(0.0, noise_std);
    for (double& coordinate : scan.leftCols(seen).reshaped()) coordinate += noise(rng);
    scan.rightCols(spurious) = scatter(spurious, {-clutter, -clutter}, {clutter, clutter}, rng);
    return scan;
}

}  // namespace icp2d
