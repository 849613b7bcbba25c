// SE(2), the rigid motions of the plane (section 2 of the lesson).
//
// T_a_b takes coordinates in frame b to coordinates in frame a:
//
//     p_a = T_a_b * p_b        T_a_c = T_a_b * T_b_c        T_b_a = T_a_b.inverse()

#pragma once

#include <cmath>

#include <Eigen/Geometry>

namespace icp2d {

using Points = Eigen::Matrix2Xd;  // one point a column, in metres

inline constexpr double pi = 3.141592653589793;

/// A pose or an increment, as a person reads it.
struct Pose {
    double x = 0.0;      // m
    double y = 0.0;      // m
    double theta = 0.0;  // rad, counter-clockwise
};

/// Wraps an angle into (−π, π]; one that lies there already comes back bit for bit.
inline double wrap(double angle) {
    if (-pi < angle && angle <= pi) return angle;
    const double wrapped = std::remainder(angle, 2.0 * pi);
    return wrapped > -pi ? wrapped : pi;
}

/// The heading of a transform, in (−π, π].
inline double heading(const Eigen::Isometry2d& T) {
    return wrap(std::atan2(T(1, 0), T(0, 0)));
}

inline Eigen::Isometry2d to_transform(const Pose& pose) {
    return Eigen::Translation2d(pose.x, pose.y) * Eigen::Rotation2Dd(pose.theta);
}

inline Pose to_pose(const Eigen::Isometry2d& T) {
    return {T(0, 2), T(1, 2), heading(T)};
}

}  // namespace icp2d
