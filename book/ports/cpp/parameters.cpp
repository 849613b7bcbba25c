#include "parameters.hpp"

#include <sstream>
#include <stdexcept>

namespace icp2d {
namespace {

template <typename Number>
void require(bool inside, const char* name, const char* range, Number received) {
    if (inside) return;
    std::ostringstream message;
    message << '`' << name << "` must be " << range << ", got " << received;
    throw std::invalid_argument(message.str());
}

}  // namespace

void require_valid(const Parameters& p) {
    require(p.max_correspondence_distance > 0.0, "max_correspondence_distance", "above 0 m",
            p.max_correspondence_distance);
    require(p.overlap_ratio > 0.0 && p.overlap_ratio <= 1.0, "overlap_ratio", "in (0, 1]",
            p.overlap_ratio);
    require(p.huber_delta > 0.0, "huber_delta", "above 0 m", p.huber_delta);
    require(p.max_iterations >= 1, "max_iterations", "at least 1", p.max_iterations);
    require(p.translation_tolerance >= 0.0, "translation_tolerance", "at least 0 m",
            p.translation_tolerance);
    require(p.rotation_tolerance >= 0.0, "rotation_tolerance", "at least 0 rad",
            p.rotation_tolerance);
    require(p.cost_tolerance >= 0.0, "cost_tolerance", "at least 0 m²", p.cost_tolerance);
}

}  // namespace icp2d
