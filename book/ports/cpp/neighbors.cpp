#include "neighbors.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

namespace icp2d {

NearestNeighbors::NearestNeighbors(const Points& points) {
    sorted_.reserve(static_cast<std::size_t>(points.cols()));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
        sorted_.push_back({points(0, i), points(1, i), i});
    }
    std::sort(sorted_.begin(), sorted_.end(),
              [](const Entry& a, const Entry& b) { return a.x < b.x; });
}

Eigen::Vector2d NearestNeighbors::find(const Eigen::Vector2d& query) const {
    const Entry* nearest = &sorted_.front();
    double nearest_squared = std::numeric_limits<double>::infinity();

    // Looks at one entry; says whether the next one on this side can be as near.
    const auto consider = [&](const Entry& entry) {
        const double dx = query.x() - entry.x;
        const double dy = query.y() - entry.y;
        const double squared = dx * dx + dy * dy;
        if (squared < nearest_squared ||
            (squared == nearest_squared && entry.index < nearest->index)) {
            nearest = &entry;
            nearest_squared = squared;
        }
        return dx * dx <= nearest_squared;
    };

    const auto middle = std::lower_bound(sorted_.begin(), sorted_.end(), query.x(),
                                         [](const Entry& entry, double x) { return entry.x < x; });
    std::find_if_not(middle, sorted_.end(), consider);
    std::find_if_not(std::make_reverse_iterator(middle), sorted_.rend(), consider);
    return {nearest->x, nearest->y};
}

}  // namespace icp2d
