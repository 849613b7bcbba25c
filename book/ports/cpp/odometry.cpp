#include "odometry.hpp"

#include <utility>

namespace icp2d {

Pose integrate_step(const Pose& pose, const Pose& increment) {
    const Eigen::Vector2d moved = to_transform(pose) * Eigen::Vector2d(increment.x, increment.y);
    return {moved.x(), moved.y(), wrap(pose.theta + increment.theta)};
}

std::vector<Pose> integrate(const Pose& start, const std::vector<Pose>& increments) {
    std::vector<Pose> poses{{start.x, start.y, wrap(start.theta)}};
    poses.reserve(increments.size() + 1);
    for (const Pose& increment : increments) {
        poses.push_back(integrate_step(poses.back(), increment));
    }
    return poses;
}

std::optional<Result> step(Odometry& odometry, Points scan, std::optional<Pose> prior) {
    const auto& target = odometry.previous_scan;
    const Pose guess = target ? prior.value_or(odometry.last_motion) : Pose{};

    std::optional<Result> match;
    if (target && target->cols() > 0 && scan.cols() > 0) {
        match = icp(scan, *target, to_transform(guess), odometry.parameters);
    }
    const bool matched = match && match->T_target_source;
    const Pose increment = matched ? to_pose(*match->T_target_source) : guess;

    odometry.pose = integrate_step(odometry.pose, increment);
    odometry.last_motion = matched || prior ? increment : Pose{};
    odometry.previous_scan = std::move(scan);
    return match;
}

}  // namespace icp2d
