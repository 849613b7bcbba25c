// The nearest target point of a source point (box D of the lesson's flow chart).

#pragma once

#include <vector>

#include "se2.hpp"

namespace icp2d {

/// The points of a scan, sorted by x once and asked often.
///
/// A query walks away from its own x in both directions, and stops where the difference in x
/// alone exceeds the distance found. It is exact: of equally near points it takes the first.
class NearestNeighbors {
public:
    explicit NearestNeighbors(const Points& points);  // at least one

    /// The point nearest to `query`.
    Eigen::Vector2d find(const Eigen::Vector2d& query) const;

private:
    struct Entry {
        double x, y;
        Eigen::Index index;  // in the scan
    };
    std::vector<Entry> sorted_;
};

}  // namespace icp2d
